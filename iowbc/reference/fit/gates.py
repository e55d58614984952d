"""The gates of the fitted network on held-out samples."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.generator import FitGates
from iowbc.reference.fit.smoothness import Jumps
from iowbc.reference.fit.task_error import TaskErrors
from iowbc.reference.labels.dataset import Dataset

WORST = 10


@dataclass(frozen=True)
class Verdict:
    """Metrics and gates on held-out samples."""

    metrics: dict[str, float]
    gates: dict[str, dict[str, float | bool | None]]
    """Value, limit and result of each gate."""
    failures: list[str]
    worst: list[str]
    """The worst held-out samples in words."""


def judge_fit(
    gates: FitGates, dataset: Dataset, held: Indices, predicted: Array, errors: TaskErrors, jumps: Jumps
) -> Verdict:
    """Compares predictions (n, 15) for the dataset's rows `held` with labels and commands."""
    difference = predicted - dataset.support[held]
    per_sample = np.sqrt((difference**2).mean(axis=1))
    metrics = {
        "joint_rmse": float(np.sqrt((difference**2).mean())),
        "joint_median": float(np.median(np.abs(difference))),
        "joint_p99": float(np.percentile(np.abs(difference), 99)),
        "height_p95": float(np.percentile(np.abs(errors.height), 95)),
        "pitch_p95": float(np.percentile(np.abs(errors.pitch), 95)),
        "foot_p95": float(np.percentile(errors.foot, 95)),
        "foot_rotation_p95": float(np.percentile(errors.foot_rotation, 95)),
        "margin_p1": float(np.percentile(errors.margin, 1)),
        "margin_median": float(np.median(errors.margin)),
        "jump": float(jumps.largest.max()),
        "jump_median": float(np.median(jumps.largest)),
    }
    judged: dict[str, dict[str, float | bool | None]] = {}
    failures: list[str] = []
    for name, limit in gates.model_dump().items():
        value = metrics[name]
        passed = limit is None or (value >= limit if name == "margin_p1" else value <= limit)
        judged[name] = {"value": value, "limit": limit, "passed": passed}
        if not passed:
            failures.append(f"{name} is {value:.4g}, the limit {limit:.4g}")
    order = np.argsort(-per_sample)[:WORST]
    worst = [
        f"number {dataset.index[held[i]]} "
        f"(height {dataset.command[held[i], 0]:.3f} m, pitch {dataset.command[held[i], 1]:+.3f} rad): "
        f"joints {per_sample[i]:.4f} rad, height {1e3 * errors.height[i]:+.1f} mm, pitch {errors.pitch[i]:+.4f} rad, "
        f"feet {1e3 * errors.foot[i]:.1f} mm"
        for i in order
    ]
    return Verdict(metrics, judged, failures, worst)
