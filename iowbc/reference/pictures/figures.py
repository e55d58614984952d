"""Figures of the dataset and of the fitted network."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from iowbc.arrays import Array
from iowbc.control.feasible_map import FeasibleMap
from iowbc.recipe.generator import FitGates
from iowbc.reference.fit.smoothness import Jumps
from iowbc.reference.fit.task_error import TaskErrors
from iowbc.reference.labels.checks import MethodComparison
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.region import GentleRegion, LabelledRegion

DOTS = 140
"""Resolution of the pictures [1/inch]."""
INK, SOFT, WARM = "#1f3b57", "#8fb1cc", "#d1603d"
PALE = "#e4ebf1"
BINS, FEWEST_BINS = 60, 20
SHOWN = 99.8
"""Percentile at which the axis of an error ends, so that a single outlier does not squeeze the rest."""


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
        limit = Limit(plan.recipe.crosscheck.p90_limit, "limit of the 90th percentile")
        _histogram(axes, check.difference, "largest joint difference [rad]", limit, everything=True)
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
    most, p95, p1 = "gate of the RMSE of all", "gate of the 95th percentile", "gate of the 1st percentile"
    _histogram(axes[0], per_sample, "joint RMSE of a sample [rad]", _limit(gates.joint_rmse, most))
    _histogram(axes[1], 1e3 * np.abs(errors.height), "height error [mm]", _limit(gates.height_p95, p95, 1e3))
    _histogram(axes[2], np.abs(errors.pitch), "torso pitch error [rad]", _limit(gates.pitch_p95, p95))
    _histogram(axes[3], 1e3 * errors.foot, "foot mismatch [mm]", _limit(gates.foot_p95, p95, 1e3))
    margin = _limit(gates.margin_p1, p1, 1e2)
    _histogram(axes[4], 1e2 * errors.margin, "support margin [cm]", margin, everything=True)
    jump = _limit(gates.jump, "gate of the largest")
    _histogram(axes[5], jumps.largest, "largest jump on a line [rad]", jump, counted="lines", everything=True)
    figure.suptitle(f"Held-out errors of the reference generator, {len(labels)} samples")
    _write(figure, folder / "errors.png")

    figure, (axis,) = _figure(1, 1, 7.0, 4.2)
    rmse = np.sqrt(((predicted - labels) ** 2).mean(axis=0))
    axis.barh(np.arange(len(joints)), rmse, color=SOFT, edgecolor=INK)
    axis.set_yticks(np.arange(len(joints)), [name.removesuffix("_joint").replace("_", " ") for name in joints])
    axis.invert_yaxis()
    axis.set_xlabel("held-out RMSE [rad]")
    axis.set_title(f"Error of each joint, {len(labels)} samples")
    _write(figure, folder / "joints.png")


def gentle_figure(folder: Path, plan: SamplePlan, region: GentleRegion, held: FeasibleMap) -> None:
    """The feasible map over how far the reference moves for one step of the command."""
    figure, (axes,) = _figure(1, 1, 6.0, 4.2)
    top = 2.0 * plan.recipe.feasible.jump
    shown = axes.pcolormesh(
        plan.pitches, plan.heights, region.jump.T, cmap="Blues_r", vmin=0.0, vmax=top, shading="nearest"
    )
    figure.colorbar(shown, ax=axes, label="largest joint move for one step [rad]", extend="max")
    _outline(axes, plan, held, "map of labelled commands", "--")
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
    colours = ListedColormap([PALE, SOFT])
    left.pcolormesh(plan.pitches, plan.heights, region.held.T, cmap=colours, vmin=0.0, vmax=1.0, shading="nearest")
    left.set_title("commands with a label for one of two arm postures")
    share = np.ma.masked_array(region.share.T, region.share.T < 0.0)
    shown = right.pcolormesh(plan.pitches, plan.heights, share, cmap="viridis", vmin=0.0, vmax=1.0, shading="nearest")
    right.set_title("all arm postures tried nearby (white: too few)")
    figure.colorbar(shown, ax=right, label="share with a label")
    if share.mask.all():
        text = f"no window of commands was tried {plan.recipe.feasible.enough} times"
        right.text(0.5, 0.5, text, ha="center", va="center", transform=right.transAxes, color=INK)
    for axes in (left, right):
        _outline(axes, plan, region.map, "map of labelled commands")
    cells = [Patch(color=SOFT, label="label"), Patch(color=PALE, label="no label")]
    left.legend(handles=[*cells, *left.get_lines()], loc="lower left")
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
    torque = np.abs(dataset.torque / effort).max(axis=1)
    _histogram(left, torque, "largest torque [share of its limit]", everything=True)
    least = _limit(plan.recipe.gates.support_margin, "least that is kept", 1e2)
    _histogram(middle, 1e2 * dataset.margin, "support margin [cm]", least, everything=True)
    _histogram(right, 1e3 * (dataset.reached - dataset.command[:, 0]), "height error [mm]", everything=True)
    figure.suptitle(f"What the labels need and how well they do, {len(dataset)} samples")
    _write(figure, path)


@dataclass(frozen=True)
class Limit:
    """A limit and what it holds for."""

    value: float
    meaning: str


def _limit(value: float | None, meaning: str, factor: float = 1.0) -> Limit | None:
    return None if value is None else Limit(factor * value, meaning)


def _histogram(
    axes: Any,
    values: Array,
    label: str,
    limit: Limit | None = None,
    *,
    counted: str = "samples",
    everything: bool = False,
) -> None:
    """Counts, with the limit as a dashed line; says how many lie beyond the axis where not `everything` is drawn."""
    low, high = float(values.min()), float(values.max() if everything else np.percentile(values, SHOWN))
    if limit is not None:
        low, high = min(low, limit.value), max(high, limit.value)
    bins = min(BINS, max(FEWEST_BINS, len(values) // 4))
    drawn, _, _ = axes.hist(values, np.linspace(low, high + 1e-9, bins), color=SOFT, edgecolor=INK, linewidth=0.3)
    if beyond := len(values) - int(drawn.sum()):
        text = f"{beyond} beyond, up to {values.max():.3g}"
        axes.text(
            0.98, 0.6, text, ha="right", transform=axes.transAxes, fontsize="small", color=INK, backgroundcolor="white"
        )
    if limit is not None:
        axes.axvline(limit.value, color=WARM, linestyle="--", label=limit.meaning)
        axes.legend(fontsize="small")
    axes.locator_params(axis="x", nbins=5)
    axes.set_xlabel(label)
    axes.set_ylabel(counted)


def _figure(rows: int, columns: int, width: float, height: float) -> tuple[Figure, list[Any]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = np.atleast_1d(np.asarray(figure.subplots(rows, columns)))
    return figure, list(axes.ravel())


def _write(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=DOTS)
