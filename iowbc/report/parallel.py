"""Parallel coordinates: an upright axis for each setting and outcome of a sweep, and a line for every point."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from pydantic import JsonValue

from iowbc.recipe.sweep import written
from iowbc.results.picture import COLOURS

ORDERS = 30.0
"""Ratio of the largest to the smallest value from which an axis is logarithmic."""
VALUES_NAMED = 8
"""Maximum number of distinct values of a setting that are all labelled on its axis."""
AXIS_WIDTH = 1.9
"""Distance of two axes [inch]."""


@dataclass(frozen=True)
class Line:
    """One point: its settings, and the outcomes of its runs."""

    label: str
    settings: Mapping[str, JsonValue]
    """By the last word of their paths, or the whole path where two end alike."""
    means: Mapping[str, float]
    """Mean of each outcome; all lines have the same. NaN where there is none, as in the two below."""
    halves: Mapping[str, float]
    """Half the interval of each mean."""
    runs: Sequence[Mapping[str, float]]
    """Outcomes of each single run."""


@dataclass(frozen=True)
class AxisScale:
    """An upright axis from 0 to 1."""

    name: str
    height: Callable[[JsonValue], float]
    """Position of a value on the axis; NaN if it has none."""
    marks: Sequence[tuple[float, str]]
    """Positions and texts of labels."""


def parallel_coordinates(lines: Sequence[Line], title: str) -> Figure:
    """Axes for settings, then outcomes; thick lines: means, bars: their intervals, thin lines: single runs."""
    settings, outcomes = [*lines[0].settings], [*lines[0].means]
    scales = [_setting(name, lines) for name in settings] + [_outcome(name, lines) for name in outcomes]
    figure = Figure(figsize=(max(6.0, AXIS_WIDTH * len(scales) + 1.0), 4.6), layout="constrained")
    axes = figure.subplots()

    def draw(values: Sequence[JsonValue], **style: Any) -> None:
        heights = [scale.height(value) for scale, value in zip(scales, values, strict=True)]
        axes.plot(range(len(scales)), heights, **style)

    for line, colour in zip(lines, _colours(figure, axes, lines, outcomes), strict=True):
        for run in line.runs if len(line.runs) > 1 else ():
            draw([*line.settings.values(), *run.values()], color=colour, lw=0.7, alpha=0.5)
        draw([*line.settings.values(), *line.means.values()], color=colour, lw=2.2, marker="o", ms=4, label=line.label)
        for place, (name, mean) in enumerate(line.means.items(), len(settings)):
            ends = [scales[place].height(mean + side * line.halves[name]) for side in (-1.0, 1.0)]
            axes.plot([place, place], ends, color=colour, lw=5, alpha=0.35, solid_capstyle="butt")
    for place, scale in enumerate(scales):
        axes.axvline(place, color="0.3", lw=0.8, zorder=0)
        for height, text in scale.marks:
            label = axes.annotate(text, (place, height), (-5, 0), textcoords="offset points", ha="right", va="center")
            label.set(size=7, zorder=5, path_effects=[withStroke(linewidth=3, foreground="white")])
    axes.set_xticks(range(len(scales)), [scale.name for scale in scales], fontsize=8)
    axes.set(yticks=[], xlim=(-0.6, len(scales) - 0.7), ylim=(-0.06, 1.06))
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)
    if len(lines) <= len(COLOURS):
        figure.legend(loc="outside lower center", ncols=min(3, len(lines)), fontsize=7, frameon=False)
    figure.suptitle(title, fontsize=9)
    return figure


def _setting(name: str, lines: Sequence[Line]) -> AxisScale:
    """The axis of a setting: numbers to scale, other values at equal distances."""
    values = [line.settings[name] for line in lines]
    numbers = [float(value) for value in values if isinstance(value, (int, float)) and not isinstance(value, bool)]
    if len(numbers) == len(values):
        return _numbers(name, numbers, named=True)
    texts = list(dict.fromkeys(map(written, values)))
    places = dict(zip(texts, np.linspace(0.0, 1.0, len(texts)) if len(texts) > 1 else [0.5], strict=True))
    return AxisScale(name, lambda value: places.get(written(value), math.nan), [(places[text], text) for text in texts])


def _outcome(name: str, lines: Sequence[Line]) -> AxisScale:
    """The axis of an outcome, with room for every interval."""
    found = [run[name] for line in lines for run in line.runs]
    found += [line.means[name] + side * line.halves[name] for line in lines for side in (-1.0, 1.0)]
    return _numbers(
        name.replace(" ", "\n", 1), [value for value in found if math.isfinite(value)] or [0.0], named=False
    )


def _numbers(name: str, values: Sequence[float], *, named: bool) -> AxisScale:
    low, high = min(values), max(values)
    logarithmic = named and low > 0 and high / low > ORDERS
    scale = LogNorm(low, high) if logarithmic else Normalize(low, high)

    def height(value: JsonValue) -> float:
        if not (isinstance(value, (int, float)) and math.isfinite(value)):
            return math.nan
        return float(scale(value)) if low < high else 0.5

    marked = sorted(set(values))
    if not (named and len(marked) <= VALUES_NAMED):
        ticks = [float(tick) for tick in MaxNLocator(5).tick_values(low, high) if low <= tick <= high]
        marked = sorted({low, high}) if logarithmic else ticks or marked
    return AxisScale(name, height, [(height(value), f"{value:.4g}") for value in marked])


def _colours(figure: Figure, axes: Axes, lines: Sequence[Line], outcomes: Sequence[str]) -> Sequence[object]:
    """A colour per line: from the palette, or for many lines by the last outcome."""
    if len(lines) <= len(COLOURS) or not outcomes:
        return [COLOURS[place % len(COLOURS)] for place in range(len(lines))]
    last = [line.means[outcomes[-1]] for line in lines]
    finite = [value for value in last if math.isfinite(value)] or [0.0]
    shade = ScalarMappable(Normalize(min(finite), max(finite)), matplotlib.colormaps["viridis"])
    figure.colorbar(shade, ax=axes, label=outcomes[-1], pad=0.01)
    return list(shade.to_rgba(np.array(last)))
