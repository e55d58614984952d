"""Figures of the dataset and of the fitted network."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from iowbc.arrays import Array
from iowbc.control.feasible_map import FeasibleMap
from iowbc.recipe.generator import FitGates
from iowbc.reference.fit.errors import TaskErrors
from iowbc.reference.labels.checks import MethodComparison
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.region import LabelledRegion
from iowbc.results.picture import write_figure

INK, SOFT, WARM = "#1f3b57", "#8fb1cc", "#d1603d"
PALE = "#e4ebf1"
BINS, FEWEST_BINS = 60, 20
SHOWN = 99.8
"""Percentile at which the axis of an error ends, so that single outliers do not stretch it."""


def dataset_figures(
    folder: Path,
    plan: SamplePlan,
    dataset: Dataset,
    region: LabelledRegion,
    rejected: Mapping[str, int],
    check: MethodComparison | None,
) -> None:
    """Feasible map, reasons of rejection, effort and margin of the labels, and the comparison with optimal control."""
    write_figure(_labelled_map(plan, region), folder / "labelled_map.png")
    counts = {"kept": len(dataset), **rejected}
    figure, (axes,) = _figure(1, 1, 6.0, 0.8 + 0.4 * len(counts))
    bars = _ranked(axes, list(counts), list(counts.values()), "samples", color=[INK, *[SOFT] * len(rejected)])
    axes.bar_label(bars, padding=3)
    axes.set_xlim(0, 1.15 * max(counts.values()))
    write_figure(figure, folder / "rejections.png")

    figure, (left, middle, right) = _figure(1, 3, 11.0, 3.4)
    torque = np.abs(dataset.torque / plan.robot.effort[plan.robot.support]).max(axis=1)
    histogram(left, torque, "largest torque [share of its limit]", everything=True)
    least, meaning = plan.recipe.gates.support_margin, "least that is kept"
    histogram(middle, dataset.margin, "support margin [cm]", least, meaning, factor=1e2, everything=True)
    histogram(right, 1e3 * (dataset.reached - dataset.command[:, 0]), "height error [mm]", everything=True)
    figure.suptitle(f"Effort, margin and height of the labels, {len(dataset)} samples")
    write_figure(figure, folder / "labels.png")
    if check is not None:
        write_figure(crosscheck_figure(check, plan.recipe.crosscheck.p90_limit), folder / "crosscheck.png")


def crosscheck_figure(check: MethodComparison, limit: float) -> Figure:
    """Differences between static labels and optimal control, with the limit of their 90th percentile [rad]."""
    figure, (axes,) = _figure(1, 1, 5.0, 3.4)
    meaning = "limit of the 90th percentile"
    histogram(axes, check.difference, "largest joint difference [rad]", limit, meaning, everything=True)
    axes.set_title(f"static labels against optimal control, {len(check.difference)} samples")
    return figure


def error_figures(
    folder: Path,
    labels: Array,
    predicted: Array,
    errors: TaskErrors,
    jumps: Array,
    gates: FitGates,
    joints: Sequence[str],
) -> None:
    """Histograms of the held-out errors with their gates, and the error of each joint."""
    figure, axes = _figure(2, 3, 11.0, 6.0)
    squared = (predicted - labels) ** 2
    most, p95, p1 = "gate of the RMSE of all", "gate of the 95th percentile", "gate of the 1st percentile"
    largest, rmse = "gate of the largest", np.sqrt(squared.mean(axis=1))
    histogram(axes[0], rmse, "joint RMSE of a sample [rad]", gates.joint_rmse, most)
    histogram(axes[1], np.abs(errors.height), "height error [mm]", gates.height_p95, p95, factor=1e3)
    histogram(axes[2], np.abs(errors.pitch), "torso pitch error [rad]", gates.pitch_p95, p95)
    histogram(axes[3], errors.foot, "foot mismatch [mm]", gates.foot_p95, p95, factor=1e3)
    histogram(axes[4], errors.margin, "support margin [cm]", gates.margin_p1, p1, factor=1e2, everything=True)
    histogram(axes[5], jumps, "largest jump on a line [rad]", gates.jump, largest, counted="lines", everything=True)
    figure.suptitle(f"Held-out errors of the reference generator, {len(labels)} samples")
    write_figure(figure, folder / "errors.png")

    figure, (axis,) = _figure(1, 1, 7.0, 4.2)
    names = [name.removesuffix("_joint").replace("_", " ") for name in joints]
    _ranked(axis, names, np.sqrt(squared.mean(axis=0)), "held-out RMSE [rad]", color=SOFT, edgecolor=INK)
    axis.set_title(f"Error of each joint, {len(labels)} samples")
    write_figure(figure, folder / "joints.png")


def gentle_figure(folder: Path, plan: SamplePlan, feasible: FeasibleMap, jump: Array, held: FeasibleMap) -> None:
    """The feasible map, and the largest joint move of the reference for one step of the command, (pitches, heights)."""
    figure, (axes,) = _figure(1, 1, 6.0, 4.2)
    shown = _on_grid(axes, plan, jump, "Blues_r", 2.0 * plan.recipe.feasible.jump)
    figure.colorbar(shown, ax=axes, label="largest joint move for one step [rad]", extend="max")
    _outline(axes, plan, held, "map of labelled commands", "--")
    _outline(axes, plan, feasible, "feasible map")
    axes.legend(loc="lower left")
    write_figure(figure, folder / "feasible_map.png")


def learning_figure(folder: Path, training: Sequence[float], validation: Sequence[float]) -> None:
    figure, (axes,) = _figure(1, 1, 5.0, 3.4)
    epochs = np.arange(1, len(training) + 1)
    axes.semilogy(epochs, training, color=SOFT, label="training")
    axes.semilogy(epochs, validation, color=INK, label="validation")
    axes.set(xlabel="epoch", ylabel="loss [rad²]")
    axes.legend(frameon=False, loc="upper right")
    write_figure(figure, folder / "learning.png")


def _labelled_map(plan: SamplePlan, region: LabelledRegion) -> Figure:
    figure, (left, right) = _figure(1, 2, 10.0, 4.2)
    _on_grid(left, plan, region.held, ListedColormap([PALE, SOFT]))
    left.set_title("commands with a label for one of two arm postures")
    share = np.ma.masked_array(region.share, region.share < 0.0)
    shown = _on_grid(right, plan, share, "viridis")
    right.set_title("all arm postures tried nearby (white: too few)")
    figure.colorbar(shown, ax=right, label="share with a label")
    if share.mask.all():
        text = f"no window of commands was tried {plan.recipe.feasible.enough} times"
        right.text(0.5, 0.5, text, ha="center", va="center", transform=right.transAxes, color=INK)
    for axes in (left, right):
        _outline(axes, plan, region.map, "map of labelled commands")
    cells = [Patch(color=SOFT, label="label"), Patch(color=PALE, label="no label")]
    left.legend(handles=[*cells, *left.get_lines()], loc="lower left")
    return figure


def _on_grid(axes: Any, plan: SamplePlan, values: Array, colours: Any, top: float = 1.0) -> Any:
    """Values (pitches, heights) from 0 to `top` as colours."""
    return axes.pcolormesh(plan.pitches, plan.heights, values.T, cmap=colours, vmin=0.0, vmax=top, shading="nearest")


def _outline(axes: Any, plan: SamplePlan, outline: FeasibleMap, label: str, style: str = "-") -> None:
    pitch = np.concatenate([outline.pitch, outline.pitch[::-1], outline.pitch[:1]])
    height = np.concatenate([outline.low, outline.high[::-1], outline.low[:1]])
    axes.plot(pitch, height, color=WARM, linewidth=2, linestyle=style, label=label)
    axes.set(xlim=plan.pitches[[0, -1]], ylim=plan.heights[[0, -1]])
    axes.set(xlabel="torso pitch [rad]", ylabel=f"{plan.recipe.height} height [m]")


def _ranked(axes: Any, names: Sequence[str], values: Any, label: str, **style: Any) -> Any:
    """A horizontal bar for each name, the first at the top."""
    bars = axes.barh(np.arange(len(names)), values, **style)
    axes.set_yticks(np.arange(len(names)), names)
    axes.invert_yaxis()
    axes.set_xlabel(label)
    return bars


def histogram(
    axes: Any,
    values: Array,
    label: str,
    limit: float | None = None,
    meaning: str = "",
    *,
    factor: float = 1.0,
    counted: str = "samples",
    everything: bool = False,
) -> None:
    """Histogram of values times `factor`, with a dashed limit; without `everything` it counts those beyond the axis."""
    values = factor * values
    low, high = float(values.min()), float(values.max() if everything else np.percentile(values, SHOWN))
    if limit is not None:
        limit *= factor
        low, high = min(low, limit), max(high, limit)
        axes.axvline(limit, color=WARM, linestyle="--", label=meaning)
        axes.legend(fontsize="small", loc="upper right")
    bins = min(BINS, max(FEWEST_BINS, len(values) // 4))
    drawn, _, _ = axes.hist(values, np.linspace(low, high + 1e-9, bins), color=SOFT, edgecolor=INK, linewidth=0.3)
    if beyond := len(values) - int(drawn.sum()):
        style = {"fontsize": "small", "color": INK, "backgroundcolor": "white"}
        text = f"{beyond} beyond, up to {values.max():.3g}"
        axes.text(0.98, 0.6, text, ha="right", transform=axes.transAxes, **style)
    axes.locator_params(axis="x", nbins=5)
    axes.set(xlabel=label, ylabel=counted)


def _figure(rows: int, columns: int, width: float, height: float) -> tuple[Figure, list[Any]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False).flat)
