"""The gates of the fitted network: jumps for a small step of the command, and errors on held-out samples."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.control.feasible_map import FeasibleMap
from iowbc.control.generator import ReferenceNetwork
from iowbc.recipe.generator import FitGates, ReferenceGenerator
from iowbc.reference.fit.task_error import TaskErrors
from iowbc.reference.labels.dataset import Dataset


def measure_jumps(
    network: ReferenceNetwork, recipe: ReferenceGenerator, feasible: FeasibleMap, arm: Array, seed: int
) -> Array:
    """Largest joint move for one step on each of some random lines between feasible commands, shape (lines,) [rad].

    Line i keeps the arms arm[i % n]. A step is one step of the height, one of the pitch, or a mixture of parts of both
    that add up to one. Steps outside the map, which need not be convex, do not count.
    """
    generator, smooth = np.random.default_rng(seed), recipe.fit.smoothness
    largest: Array = np.empty(smooth.lines)
    for line in range(smooth.lines):
        pitch = generator.uniform(feasible.pitch[0], feasible.pitch[-1], 2)
        low, high = np.interp(pitch, feasible.pitch, feasible.low), np.interp(pitch, feasible.pitch, feasible.high)
        height = generator.uniform(low, high)
        steps = abs(np.diff(height)[0]) / smooth.height_step + abs(np.diff(pitch)[0]) / smooth.pitch_step
        along = np.append(np.arange(0.0, steps) / max(steps, 1e-9), 1.0)
        command = np.stack([start + along * (end - start) for start, end in (height, pitch)], axis=1)
        inside = feasible.contains(command[:, 0], command[:, 1])
        reference = network(np.tile(arm[line % len(arm)], (len(along), 1)), command)
        moved = np.abs(np.diff(reference, axis=0)).max(axis=1) * (inside[1:] & inside[:-1])
        largest[line] = moved.max()
    return largest


WORST = 10


@dataclass(frozen=True)
class Verdict:
    """Metrics and gates on held-out samples."""

    metrics: dict[str, float]
    gates: dict[str, dict[str, float | bool | None]]
    """Value, limit and result of each gate."""
    failures: list[str]
    worst: list[str]
    """Descriptions of the worst held-out samples."""


def check_fit(
    gates: FitGates, dataset: Dataset, held: Indices, predicted: Array, errors: TaskErrors, jumps: Array
) -> Verdict:
    """Compares predictions (n, 15) for the dataset's rows `held` with labels and commands; `jumps` (lines,) [rad]."""
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
        "jump": float(jumps.max()),
        "jump_median": float(np.median(jumps)),
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
