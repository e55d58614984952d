"""The paper's figures (errors against lifting mass, against pushing mass, comparison of variants), and robustness."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from string import ascii_lowercase
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from iowbc.arrays import Array
from iowbc.evaluation.paper import TABLES, VARIANTS
from iowbc.evaluation.report.aggregate import suites_of, variants_of
from iowbc.evaluation.report.captions import conditions
from iowbc.evaluation.report.columns import STANDS_STILL
from iowbc.evaluation.report.error_tables import NUMBERS, SWEPT, in_paper
from iowbc.evaluation.report.limits import Capacities, load_capacities, masses_of, push_capacities
from iowbc.evaluation.trials.errors import ERRORS, error_norm
from iowbc.results.picture import COLOURS

MARKERS = ("o", "s", "^", "D", "v", "P", "X")
LABELS = {
    "E_alpha": "$E_\\alpha$, torso pitch [rad]",
    "E_h": "$E_h$, height [m]",
    "E_v": "$E_v$, velocity [m/s]",
    "E_psi": "$E_\\psi$, heading [rad]",
}
PANEL_WIDTH, SMALLEST_WIDTH = 3.75, 7.5
"""Width of a panel of the comparison, and minimum width of the whole figure [inch]."""
VARIANTS_PER_PANEL = 4
"""Number of variants whose bars fit into a panel of `PANEL_WIDTH`; with more, it is wider."""
CASES_PER_ROW, ROW_HEIGHT = 10, 3.8
"""Cases side by side in the figure of robustness, and height of its rows [inch]."""
SUITES_PER_PANEL = 3
"""Number of suites whose capacities fit into a panel."""
LONGEST_TEXT = 5
"""With more than `VARIANTS_PER_PANEL` variants, texts above bars with more characters than this are rotated."""
TITLE_WIDTH = 110
"""Characters in a line of the title above panels that are two in a row."""
LABEL_WIDTH = 11
"""Characters in a line under a bar."""
SHIFT = 0.012
"""Horizontal offset between the intervals of two variants, as a fraction of the range of masses."""
HEADROOM = 0.15
"""Space above the highest point, as a fraction of its height."""
FAILURE_SPACING = 0.035
"""Distance between the survivor marks of two variants, as a fraction of the panel height."""
COUNT_WIDTH = 0.021
"""Width of a character of a survivor count, as a fraction of the range of masses."""
WHISKERS = {"ecolor": "black", "capsize": 3, "elinewidth": 1.0}


def style_of(variant: str, variants: Sequence[str]) -> dict[str, Any]:
    """Colour and marker of a variant, the same in every figure; `variants`: all that are shown."""
    place = [*VARIANTS, *(name for name in variants if name not in VARIANTS)].index(variant)
    return {"color": COLOURS[place % len(COLOURS)], "marker": MARKERS[place % len(MARKERS)], "markersize": 5}


def errors_against_mass(summary: pd.DataFrame, suite: str) -> Figure:
    """Four panels, one per error, over the object mass; 95 % intervals as bars, the paper's numbers hollow."""
    chosen = summary[summary["suite"] == suite]
    figure = Figure(figsize=(9.5, 6.6), layout="constrained")
    panels = list(figure.subplots(2, 2, sharex=True).flat)
    for place, (axes, name) in enumerate(zip(panels, ERRORS, strict=True)):
        _sweep_panel(axes, chosen, variants_of(summary), name, chosen[f"still_{name}"].mean(), itemgetter(place))
        axes.set(ylabel=LABELS[name], xlabel="" if place < 2 else f"{chosen['kind'].iloc[0]} mass [kg]")
    heading = f"Tracking errors against {chosen['kind'].iloc[0]} mass, bars: 95 % intervals. {conditions(chosen)}"
    return finish(figure, [], f"{textwrap.fill(heading, TITLE_WIDTH)}\n{_note(in_paper(chosen))}", panels[0])


def comparison(summary: pd.DataFrame, capacity_rate: float) -> Figure:
    """Error norm over lifting and pushing mass, load capacity, success in the heavy tasks: a panel for each that was
    evaluated."""
    sweeps = [suites_of(summary, kind)[0] for kind in NUMBERS if suites_of(summary, kind)]
    capacities = load_capacities(summary, capacity_rate)
    carried = {suite for own in capacities.values() for suite, capacity in own.items() if capacity.value is not None}
    carrying = [suite for suite in suites_of(summary, *SWEPT) if suite in carried]
    bars = max(1.0, len(variants_of(summary)) / VARIANTS_PER_PANEL)
    widths = [*(1.0 for _ in sweeps), *[bars * max(1.0, len(carrying) / SUITES_PER_PANEL)] * bool(carrying), bars]
    size = max(PANEL_WIDTH * sum(widths), SMALLEST_WIDTH), 4.2
    figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(wspace=0.06))
    panels = list(figure.subplots(1, len(widths), squeeze=False, width_ratios=widths).flat)
    for axes, suite in zip(panels, sweeps, strict=False):
        chosen = summary[summary["suite"] == suite]
        still = error_norm(chosen[[f"still_{name}" for name in ERRORS]].mean().to_numpy())
        _sweep_panel(
            axes, chosen, variants_of(summary), "norm", float(still), lambda row: float(error_norm(np.array(row)))
        )
        axes.set(title=f"error norm, {suite}", xlabel="mass [kg]", ylabel="norm of the four errors [SI units]")
    if carrying:
        _capacity_bars(panels[-2], capacities, carrying)
        panels[-2].set(title=f"load capacity at {100 * capacity_rate:.0f} % success", ylabel="mass [kg]")
    _success_panel(panels[-1], _heaviest(summary), variants_of(summary), "success rate")
    known = any(in_paper(summary[summary["suite"] == suite]) for suite in sweeps)
    return finish(figure, panels, _note(known) if sweeps else "", panels[0])


def robustness(summary: pd.DataFrame, rate: float) -> Figure:
    """Success in the robustness and stagnation suites, and the impulse on the base survived by direction."""
    parts, survived = [], push_capacities(summary, rate)
    for suite in suites_of(summary, "robustness", "stagnation", "pushes"):
        chosen = summary[summary["suite"] == suite]
        row = pd.factorize(chosen["case"])[0] // CASES_PER_ROW
        parts += [chosen[row == place] for place in range(row.max() + 1)]
    width = 1.2 * CASES_PER_ROW * max(1.0, len(variants_of(summary)) / VARIANTS_PER_PANEL)
    figure = Figure(figsize=(width, ROW_HEIGHT * len(parts)), layout="constrained")
    panels = list(figure.subplots(len(parts), 1, squeeze=False).flat)
    for axes, chosen in zip(panels, parts, strict=True):
        if (chosen["kind"] == "pushes").all():
            _capacity_bars(axes, survived, list(dict.fromkeys(chosen["case"])))
            axes.set(title=f"impulse survived, {masses_of(chosen)}", ylabel="impulse [N·s]")
        else:
            _success_panel(axes, chosen, variants_of(summary), f"success, {chosen['suite'].iloc[0]}")
        axes.set_xlim(-0.6, CASES_PER_ROW - 0.4)
    return finish(figure, panels, "", panels[0])


def draw_bars(
    axes: Axes,
    heights: Mapping[str, Array],
    texts: Mapping[str, Sequence[str]],
    labels: Sequence[str],
    intervals: Mapping[str, Array],
) -> None:
    """Grouped bars of all variants for each label, with texts above; no bar for NaN. intervals: extent below and above
    the top of each bar, (2, labels), for variants with intervals."""
    width = 0.8 / max(len(heights), 3)
    longest = max((len(text) for row in texts.values() for text in row), default=0)
    upright = len(heights) > VARIANTS_PER_PANEL and longest > LONGEST_TEXT
    for place, (variant, values) in enumerate(heights.items()):
        positions = np.arange(len(labels)) + (place - (len(heights) - 1) / 2) * width
        colour = style_of(variant, list(heights))["color"]
        spread = intervals.get(variant)
        drawn = axes.bar(positions, values, width, yerr=spread, color=colour, label=variant, error_kw=WHISKERS)
        axes.bar_label(drawn, texts[variant], padding=2, fontsize=8, rotation=90 if upright else 0)
    axes.set_xticks(range(len(labels)), labels, fontsize=8)
    _from_zero(axes)
    axes.set_xlim(-0.6, len(labels) - 0.4)
    axes.spines[["top", "right"]].set_visible(False)


def line_labels(names: Sequence[tuple[str, float]]) -> list[str]:
    """Cases and masses under bars, long names on several lines."""
    return [f"{textwrap.fill(case, LABEL_WIDTH)}\n{mass:g} kg" for case, mass in names]


def finish(figure: Figure, lettered: Sequence[Axes], title: str, legend_of: Axes | None = None) -> Figure:
    """Add letters to panel titles, a figure title, and a common legend, of the panel `legend_of`, below."""
    for axes, letter in zip(lettered, ascii_lowercase, strict=False):
        axes.set_title(f"({letter}) {axes.get_title()}", fontsize=10)
    if title:
        figure.suptitle(title, fontsize=9)
    if legend_of is not None:
        handles, labels = legend_of.get_legend_handles_labels()
        figure.legend(handles, labels, fontsize=9, ncols=len(labels), loc="outside lower center", frameon=False)
    return figure


def tidy(axes: Axes) -> None:
    _from_zero(axes)
    axes.grid(True, color="0.9")
    axes.spines[["top", "right"]].set_visible(False)


def _note(with_paper: bool) -> str:
    """The meaning of marks, grey lines and dotted ones."""
    marks = "means over the trials survived; at the upper edge: how many where not all survived, × none"
    paper = "hollow, dotted: the paper's numbers, for its own commands; the friction of its crates is unknown; "
    return f"{marks}\n{paper * with_paper}grey: a robot that stands still"


def _sweep_panel(
    axes: Axes,
    chosen: pd.DataFrame,
    variants: Sequence[str],
    column: str,
    still: float,
    of_paper: Callable[[tuple[float, ...]], float],
) -> None:
    """Plot a column over the mass in one suite for each variant, with intervals if available, the score of a robot that
    stands still, and the paper's value, `of_paper` of its four errors."""
    for place, variant in enumerate(variants):
        rows = chosen[chosen["variant"] == variant].sort_values("mass")
        style = style_of(variant, variants)
        if f"{column}_half" in rows:
            shift = SHIFT * float(np.ptp(chosen["mass"])) * (place - (len(variants) - 1) / 2)
            half = rows[f"{column}_half"].fillna(0.0)
            axes.errorbar(rows["mass"] + shift, rows[column], yerr=half, capsize=3, label=variant, **style)
        else:
            axes.plot(rows["mass"], rows[column], label=variant, **style)
        if in_paper(rows):
            name, table = rows["name_in_paper"].iloc[0], TABLES[rows["kind"].iloc[0]]
            paper = {mass: row.get(name) for mass, row in table.items()}
            points = {mass: of_paper(errors) for mass, errors in paper.items() if errors is not None}
            axes.plot(list(points), list(points.values()), linestyle=":", markerfacecolor="none", **style)
        _mark_survivors(axes, rows, place, style["color"], COUNT_WIDTH * float(np.ptp(chosen["mass"])))
    axes.axhline(still, label=STANDS_STILL, zorder=0, color="0.55", linestyle="--", linewidth=1.2)
    axes.update_datalim([(0.0, still)], updatex=False)
    tidy(axes)


def _heaviest(summary: pd.DataFrame) -> pd.DataFrame:
    """Rows of the heavy tasks or, if there are none, of the heaviest mass of each suite."""
    heavy = summary[summary["kind"] == "heavy"]
    if not heavy.empty:
        return heavy
    swept = summary[summary["kind"].isin(NUMBERS)]
    return swept[swept["mass"] == swept.groupby("suite")["mass"].transform("max")]


def _success_panel(axes: Axes, chosen: pd.DataFrame, variants: Sequence[str], title: str) -> None:
    names = list(dict.fromkeys(zip(chosen["case"], chosen["mass"], strict=True)))
    heights, texts, intervals = {}, {}, {}
    for variant in variants:
        rows = chosen[chosen["variant"] == variant].set_index(["case", "mass"]).reindex(names)
        rate, low, high = (100 * rows[name].to_numpy(float) for name in ("rate", "rate_low", "rate_high"))
        counts = zip(rows["succeeded"], rows["trials"], strict=True)
        heights[variant], intervals[variant] = rate, np.clip([rate - low, high - rate], 0.0, None)
        texts[variant] = ["" if np.isnan(trials) else f"{succeeded:.0f}/{trials:.0f}" for succeeded, trials in counts]
    draw_bars(axes, heights, texts, line_labels(names), intervals)
    axes.set(title=title, ylabel="successful trials [%], 95 % interval", ylim=(0, 110))


def _capacity_bars(axes: Axes, found: Capacities, names: Sequence[str]) -> None:
    heights = {
        v: np.array([(own[name].value or 0.0) if name in own else np.nan for name in names]) for v, own in found.items()
    }
    texts = {v: [own[name].text("").strip() if name in own else "" for name in names] for v, own in found.items()}
    draw_bars(axes, heights, texts, [textwrap.fill(name, LABEL_WIDTH) for name in names], {})


def _mark_survivors(axes: Axes, rows: pd.DataFrame, place: int, colour: str, width: float) -> None:
    """Mark masses that not all trials survived at the upper edge, one line per variant: survivors, or a cross. Counts
    that would overlap are left out. `width`: of a character [kg]."""
    style: dict[str, Any] = {"color": colour, "transform": axes.get_xaxis_transform(), "in_layout": False}
    height, failed = 0.98 - FAILURE_SPACING * place, rows[rows["survived"] == 0]["mass"]
    axes.plot(failed, [height] * len(failed), "x", clip_on=False, **style)
    free, before = -np.inf, 0.0
    for row in rows[(rows["survived"] > 0) & (rows["survived"] < rows["trials"])].itertuples():
        count = f"{row.survived}/{row.trials}"
        needed = width * len(count)
        if row.mass - 0.5 * (needed - before) >= free and not (abs(failed - row.mass) < 0.6 * needed).any():
            axes.text(float(row.mass), height, count, ha="center", va="center", fontsize=7, **style)
            free, before = row.mass + needed, needed


def _from_zero(axes: Axes) -> None:
    """Set the vertical axis from 0 to above the highest point, with space for its marker, bar label and interval."""
    highest = axes.dataLim.ymax
    axes.set_ylim(0.0, (1.0 + HEADROOM) * highest if np.isfinite(highest) and highest > 0 else 1.0)
