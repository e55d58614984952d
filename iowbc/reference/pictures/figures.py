"""Figures of the dataset and of the fitted network."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from iowbc.control.feasible_map import FeasibleMap
from iowbc.recipe.generator import FitGates
from iowbc.reference.fit.smoothness import Jumps
from iowbc.reference.fit.task_error import TaskErrors
from iowbc.reference.labels.checks import MethodComparison
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.region import GentleRegion, LabelledRegion

Array = NDArray[Any]

DOTS = 140
"""Resolution of the pictures [1/inch]."""
INK, SOFT, WARM = "#1f3b57", "#8fb1cc", "#d1603d"
BINS = 60


def dataset_figures(
    folder: Path,
    plan: SamplePlan,
    dataset: Dataset,
    region: LabelledRegion,
    rejected: Mapping[str, int],
    check: MethodComparison | None,
) -> None:
    """Feasible map, reasons of rejection, what the labels need, and the comparison with optimal control."""
    _labelled_map(folder / "labelled_map.png", plan, region)
    _rejections(folder / "rejections.png", len(dataset), rejected)
    _physics(folder / "labels.png", plan, dataset)
    if check is not None:
        figure, (axes,) = _figure(1, 1, 5.0, 3.4)
        _histogram(axes, check.difference, plan.recipe.crosscheck.p90_limit, "largest joint difference [rad]")
        axes.set_title(f"static labels against optimal control, {check.count} samples")
        _write(figure, folder / "crosscheck.png")


def error_figures(
    folder: Path,
    labels: Array,
    predicted: Array,
    errors: TaskErrors,
    jumps: Jumps,
    gates: FitGates,
    joints: Sequence[str],
) -> None:
    """Histograms of the held-out errors with their gates, and the error of each joint."""
    figure, axes = _figure(2, 3, 11.0, 6.0)
    per_sample = np.sqrt(((predicted - labels) ** 2).mean(axis=1))
    _histogram(axes[0], per_sample, gates.joint_rmse, "joint RMSE of a sample [rad]")
    _histogram(axes[1], 1e3 * np.abs(errors.height), _scaled(gates.height_p95, 1e3), "height error [mm]")
    _histogram(axes[2], np.abs(errors.pitch), gates.pitch_p95, "torso pitch error [rad]")
    _histogram(axes[3], 1e3 * errors.foot, _scaled(gates.foot_p95, 1e3), "foot mismatch [mm]")
    _histogram(axes[4], 1e2 * errors.margin, _scaled(gates.margin_p1, 1e2), "support margin [cm]", top=100.0)
    _histogram(axes[5], jumps.largest, gates.jump, "largest jump on a line [rad]", top=100.0)
    figure.suptitle(f"Held-out errors of the reference generator, {len(labels)} samples (dashed: gate)")
    _write(figure, folder / "errors.png")

    figure, (axis,) = _figure(1, 1, 7.0, 4.2)
    rmse = np.sqrt(((predicted - labels) ** 2).mean(axis=0))
    axis.barh(np.arange(len(joints)), rmse, color=SOFT, edgecolor=INK)
    axis.set_yticks(np.arange(len(joints)), [name.removesuffix("_joint").replace("_", " ") for name in joints])
    axis.invert_yaxis()
    axis.set_xlabel("held-out RMSE [rad]")
    _write(figure, folder / "joints.png")


def gentle_figure(folder: Path, plan: SamplePlan, region: GentleRegion, held: FeasibleMap) -> None:
    """The feasible map over how far the reference moves for one step of the command."""
    figure, (axes,) = _figure(1, 1, 6.0, 4.2)
    top = 2.0 * plan.recipe.feasible.jump
    shown = axes.pcolormesh(
        plan.pitches, plan.heights, region.jump.T, cmap="Blues_r", vmin=0.0, vmax=top, shading="nearest"
    )
    figure.colorbar(shown, ax=axes, label="largest joint move for one step [rad]")
    _outline(axes, plan, held, "has labels", "--")
    _outline(axes, plan, region.map, "feasible map")
    axes.legend(loc="lower left")
    _write(figure, folder / "feasible_map.png")


def learning_figure(folder: Path, training: Sequence[float], validation: Sequence[float]) -> None:
    """Loss by epoch."""
    figure, (axes,) = _figure(1, 1, 5.0, 3.4)
    epochs = np.arange(1, len(training) + 1)
    axes.semilogy(epochs, training, color=SOFT, label="training")
    axes.semilogy(epochs, validation, color=INK, label="validation")
    axes.set_xlabel("epoch")
    axes.set_ylabel("loss [rad²]")
    axes.legend(frameon=False)
    _write(figure, folder / "learning.png")


def _labelled_map(path: Path, plan: SamplePlan, region: LabelledRegion) -> None:
    figure, (left, right) = _figure(1, 2, 10.0, 4.2)
    left.pcolormesh(plan.pitches, plan.heights, region.held.T, cmap="Blues", vmin=-0.6, vmax=1.6, shading="nearest")
    left.set_title("has a label with one of two arm postures")
    share = np.ma.masked_array(region.share.T, region.share.T < 0.0)
    shown = right.pcolormesh(plan.pitches, plan.heights, share, cmap="viridis", vmin=0.0, vmax=1.0, shading="nearest")
    right.set_title("share of all arm postures that have a label")
    figure.colorbar(shown, ax=right)
    if share.mask.all():
        text = f"no window of commands was tried {plan.recipe.feasible.enough} times"
        right.text(0.5, 0.5, text, ha="center", va="center", transform=right.transAxes, color=INK)
    for axes in (left, right):
        _outline(axes, plan, region.map, "has labels")
    left.legend(loc="lower left")
    _write(figure, path)


def _outline(axes: Any, plan: SamplePlan, outline: FeasibleMap, label: str, style: str = "-") -> None:
    """Draws a map over the grid."""
    pitch = np.concatenate([outline.pitch, outline.pitch[::-1], outline.pitch[:1]])
    height = np.concatenate([outline.low, outline.high[::-1], outline.low[:1]])
    axes.plot(pitch, height, color=WARM, linewidth=2, linestyle=style, label=label)
    axes.set_xlim(plan.pitches[0], plan.pitches[-1])
    axes.set_ylim(plan.heights[0], plan.heights[-1])
    axes.set_xlabel("torso pitch [rad]")
    axes.set_ylabel(f"{plan.recipe.height} height [m]")


def _rejections(path: Path, kept: int, rejected: Mapping[str, int]) -> None:
    figure, (axes,) = _figure(1, 1, 6.0, 0.8 + 0.4 * (len(rejected) + 1))
    names, counts = ["kept", *rejected], [kept, *rejected.values()]
    bars = axes.barh(np.arange(len(names)), counts, color=[INK, *[SOFT] * len(rejected)])
    axes.bar_label(bars, padding=3)
    axes.set_yticks(np.arange(len(names)), names)
    axes.set_xlim(0, 1.15 * max(counts))
    axes.invert_yaxis()
    axes.set_xlabel("samples")
    _write(figure, path)


def _physics(path: Path, plan: SamplePlan, dataset: Dataset) -> None:
    figure, (left, middle, right) = _figure(1, 3, 11.0, 3.4)
    effort = plan.robot.effort[plan.robot.support]
    _histogram(left, np.abs(dataset.torque / effort).max(axis=1), None, "largest torque over its limit", top=100.0)
    _histogram(middle, 1e2 * dataset.margin, plan.recipe.gates.support_margin * 1e2, "support margin [cm]", top=100.0)
    _histogram(
        right, 1e3 * (dataset.reached - dataset.command[:, 0]), None, "height error of the labels [mm]", top=100.0
    )
    _write(figure, path)


def _histogram(axes: Any, values: Array, limit: float | None, label: str, top: float = 99.8) -> None:
    """Counts up to a percentile, with the gate as a dashed line."""
    low, high = float(values.min()), float(np.percentile(values, top))
    high = max(high, limit or high)
    axes.hist(values, bins=np.linspace(low, high + 1e-9, BINS), color=SOFT, edgecolor=INK, linewidth=0.3)
    if limit is not None:
        axes.axvline(limit, color=WARM, linestyle="--")
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel(label)
    axes.set_ylabel("samples")


def _scaled(limit: float | None, factor: float) -> float | None:
    return None if limit is None else factor * limit


def _figure(rows: int, columns: int, width: float, height: float) -> tuple[Figure, list[Any]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = np.atleast_1d(np.asarray(figure.subplots(rows, columns)))
    return figure, list(axes.ravel())


def _write(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=DOTS)
