"""The paper's figures: errors against lifting mass, against pushing mass, and the comparison of variants.

Beside them what the paper does not show: success under harder conditions, and pushes survived.
"""

import textwrap
from dataclasses import dataclass
from pathlib import Path
from string import ascii_lowercase

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from iowbc.arrays import Array
from iowbc.evaluation.paper import TABLES, VARIANTS
from iowbc.evaluation.report.aggregate import asks_for_steps, suites_of, variants_of
from iowbc.evaluation.report.capacity import Capacity, load_capacity, push_capacity
from iowbc.evaluation.report.captions import conditions
from iowbc.evaluation.report.error_tables import NUMBERS, STANDS_STILL
from iowbc.evaluation.trials.errors import ERRORS, error_norm

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Okabe and Ito's palette: told apart with any colour vision; markers repeat the distinction."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
LABELS = {
    "E_alpha": "$E_\\alpha$, torso pitch [rad]",
    "E_h": "$E_h$, height [m]",
    "E_v": "$E_v$, velocity [m/s]",
    "E_psi": "$E_\\psi$, heading [rad]",
}
MARKS = "means over the trials survived; at the upper edge: how many where not all survived, × none"
STILL_NOTE = "grey: a robot that stands still"
PAPER_NOTE = "hollow, dotted: the paper's numbers, for its own commands; the friction of its crates is unknown"
STILL_COLOUR = "0.55"
DPI = 150
PANEL_WIDTH, SMALLEST_WIDTH = 3.75, 7.5
"""Width of a panel of the comparison, and of the whole figure with its legend [inch]."""
ROOMY = 4
"""Variants whose bars and counts have room in a panel of that width; more make it wider."""
LABEL_WIDTH = 11
"""Characters in a line under a bar."""
SHIFT = 0.012
"""Distance of the intervals of two variants at one mass, in parts of the range of masses."""
HEADROOM = 0.15
"""Room above the highest point, in parts of its height."""
FAILURE_SPACING = 0.035
"""Distance of two variants' crosses and counts of survivors, in heights of the panel."""
WHISKERS = {"ecolor": "black", "capsize": 3, "elinewidth": 1.0}
"""How intervals are drawn on bars."""


@dataclass(frozen=True)
class Bars:
    """A variant's bars, one a name; NaN leaves one out."""

    heights: Array
    texts: list[str]
    intervals: Array | None = None
    """How far each reaches below and above its bar, (2, names)."""


def style_of(variant: str, variants: list[str]) -> tuple[str, str]:
    """Colour and marker of a variant, the same in every figure; `variants`: all that are shown."""
    known = [*VARIANTS, *(name for name in variants if name not in VARIANTS)]
    place = known.index(variant)
    return COLOURS[place % len(COLOURS)], MARKERS[place % len(MARKERS)]


def errors_against_mass(summary: pd.DataFrame, suite: str) -> Figure:
    """Four panels, one an error, over the mass of the object; 95 % intervals as bars; the paper's numbers hollow."""
    chosen = summary[summary["suite"] == suite]
    kind, with_paper = str(chosen["kind"].iloc[0]), asks_for_steps(chosen)
    figure = Figure(figsize=(9.5, 6.6), layout="constrained")
    for axes, name in zip(figure.subplots(2, 2, sharex=True).flat, ERRORS, strict=True):
        for variant in variants_of(summary):
            rows = _rows(summary, suite, variant)
            colour, marker = style_of(variant, variants_of(summary))
            half = rows[f"{name}_half"].fillna(0.0)
            beside = SHIFT * float(np.ptp(summary.loc[summary["suite"] == suite, "mass"]))
            masses = rows["mass"] + beside * (variants_of(summary).index(variant) - (len(variants_of(summary)) - 1) / 2)
            axes.errorbar(
                masses, rows[name], yerr=half, color=colour, marker=marker, capsize=3, label=variant, markersize=5
            )
            if with_paper:
                _paper_curve(axes, kind, variant, ERRORS.index(name), colour, marker)
            _mark_survivors(axes, rows, variant, variants_of(summary))
        _still_line(axes, float(summary.loc[summary["suite"] == suite, f"still_{name}"].mean()))
        axes.set_ylabel(LABELS[name])
        tidy(axes)
    for axes in figure.axes[2:]:
        axes.set_xlabel(f"{kind} mass [kg]")
    legend(figure, figure.axes[0])
    heading = f"Tracking errors against {kind} mass, bars: 95 % intervals. {conditions(chosen)}"
    figure.suptitle(f"{heading}\n{_note(with_paper)}", fontsize=9)
    return figure


def comparison(summary: pd.DataFrame, capacity_rate: float) -> Figure:
    """Error norm over lifting mass and over pushing mass, load capacity, success in the heavy tasks.

    A panel for each that was evaluated.
    """
    sweeps = [suites_of(summary, kind)[0] for kind in NUMBERS if suites_of(summary, kind)]
    bars = max(1.0, len(variants_of(summary)) / ROOMY)
    widths = [*(1.0 for _ in sweeps), *[bars] * bool(sweeps), bars]
    figure = Figure(
        figsize=(max(PANEL_WIDTH * sum(widths), SMALLEST_WIDTH), 4.2), layout=ConstrainedLayoutEngine(wspace=0.06)
    )
    panels = list(figure.subplots(1, len(widths), squeeze=False, width_ratios=widths).flat)
    for axes, suite in zip(panels, sweeps, strict=False):
        _norm_panel(axes, summary, suite)
    if sweeps:
        _capacity_panel(panels[-2], summary, sweeps, capacity_rate)
    _success_panel(panels[-1], _heaviest(summary))
    letter(panels)
    if sweeps:
        walked = any(asks_for_steps(summary[summary["suite"] == suite]) for suite in sweeps)
        figure.suptitle(_note(walked), fontsize=9)
    legend(figure, panels[0])
    return figure


def robustness(summary: pd.DataFrame, rate: float) -> Figure:
    """Success under harder conditions and in stagnation, and the impulse on the base survived by direction."""
    suites = suites_of(summary, "robustness", "stagnation")
    pushes = suites_of(summary, "pushes")
    panels_needed = [*suites, *pushes]
    widths = [max(2, len(summary.loc[summary["suite"] == suite, "case"].unique())) for suite in panels_needed]
    bars = max(1.0, len(variants_of(summary)) / ROOMY)
    figure = Figure(figsize=(max(1.2 * bars * sum(widths), SMALLEST_WIDTH), 4.2), layout="constrained")
    panels = list(figure.subplots(1, len(panels_needed), squeeze=False, width_ratios=widths).flat)
    for axes, suite in zip(panels, suites, strict=False):
        _success_panel(axes, summary[summary["suite"] == suite])
        axes.set_title(f"success, {suite}")
    if pushes:
        _push_panel(panels[-1], summary[summary["kind"] == "pushes"], rate)
    letter(panels)
    legend(figure, panels[0])
    return figure


def write_figure(figure: Figure, path: Path) -> None:
    """Save as PNG without the time of day in it, so that equal trials give equal files."""
    figure.savefig(path, dpi=DPI, metadata={"Software": None})


def _note(with_paper: bool) -> str:
    """What marks, grey lines and dotted ones mean."""
    return f"{MARKS}\n{'; '.join([PAPER_NOTE] * with_paper + [STILL_NOTE])}"


def _norm_panel(axes: Axes, summary: pd.DataFrame, suite: str) -> None:
    axes.set_title(f"error norm, {suite}")
    kind = str(summary.loc[summary["suite"] == suite, "kind"].iloc[0])
    still = summary.loc[summary["suite"] == suite, [f"still_{name}" for name in ERRORS]].mean().to_numpy()
    _still_line(axes, float(error_norm(still)))
    for variant in variants_of(summary):
        rows = _rows(summary, suite, variant)
        colour, marker = style_of(variant, variants_of(summary))
        axes.plot(rows["mass"], rows["norm"], color=colour, marker=marker, markersize=5, label=variant)
        if asks_for_steps(rows):
            _paper_curve(axes, kind, variant, None, colour, marker)
        _mark_survivors(axes, rows, variant, variants_of(summary))
    axes.set_xlabel("mass [kg]")
    axes.set_ylabel("norm of the four errors [SI units]")
    tidy(axes)


def _capacity_panel(axes: Axes, summary: pd.DataFrame, suites: list[str], rate: float) -> None:
    axes.set_title(f"load capacity at {100 * rate:.0f} % success")
    found = {v: [load_capacity(summary, suite, v, rate) for suite in suites] for v in variants_of(summary)}
    _capacity_bars(axes, found, suites)
    axes.set_ylabel("mass [kg]")


def _push_panel(axes: Axes, pushes: pd.DataFrame, rate: float) -> None:
    axes.set_title(f"impulse survived, {float(pushes['mass'].iloc[0]):g} kg")
    directions = list(dict.fromkeys(pushes["case"]))
    found = {v: [push_capacity(pushes, one, v, rate) for one in directions] for v in variants_of(pushes)}
    _capacity_bars(axes, found, directions)
    axes.set_ylabel("impulse [N·s]")


def _heaviest(summary: pd.DataFrame) -> pd.DataFrame:
    """The heavy tasks, or without any the heaviest mass of each suite."""
    heavy = summary[summary["kind"] == "heavy"]
    if not heavy.empty:
        return heavy
    swept = summary[summary["kind"].isin(NUMBERS)]
    return swept[swept["mass"] == swept.groupby("suite")["mass"].transform("max")]


def _success_panel(axes: Axes, chosen: pd.DataFrame) -> None:
    axes.set_title("success rate")
    names = list(dict.fromkeys(zip(chosen["case"], chosen["mass"], strict=True)))
    groups = {}
    for variant in variants_of(chosen):
        rows = chosen[chosen["variant"] == variant].set_index(["case", "mass"]).reindex(names)
        rate, low, high = (100 * rows[name].to_numpy(float) for name in ("rate", "rate_low", "rate_high"))
        counts = zip(rows["succeeded"], rows["trials"], strict=True)
        texts = ["" if np.isnan(trials) else f"{succeeded:.0f}/{trials:.0f}" for succeeded, trials in counts]
        groups[variant] = Bars(rate, texts, np.clip([rate - low, high - rate], 0.0, None))
    draw_bars(axes, groups, [f"{broken(case)}\n{mass:g} kg" for case, mass in names])
    axes.set_ylabel("successful trials [%], 95 % interval")
    axes.set_ylim(0, 110)


def _capacity_bars(axes: Axes, found: dict[str, list[Capacity | None]], names: list[str]) -> None:
    groups = {}
    for variant, row in found.items():
        heights = np.array([np.nan if one is None else one.value or 0.0 for one in row])
        groups[variant] = Bars(heights, ["" if one is None else one.text("").strip() for one in row])
    draw_bars(axes, groups, [broken(name) for name in names])


def draw_bars(axes: Axes, groups: dict[str, Bars], names: list[str]) -> None:
    """Bars of each variant, side by side over each name."""
    width = 0.8 / max(len(groups), 3)
    for place, (variant, bars) in enumerate(groups.items()):
        positions = np.arange(len(names)) + (place - (len(groups) - 1) / 2) * width
        colour = style_of(variant, list(groups))[0]
        drawn = axes.bar(
            positions, bars.heights, width, yerr=bars.intervals, color=colour, label=variant, error_kw=WHISKERS
        )
        axes.bar_label(drawn, bars.texts, padding=2, fontsize=8)
    axes.set_xticks(range(len(names)), names, fontsize=8)
    _from_zero(axes)
    axes.set_xlim(-0.6, len(names) - 0.4)
    axes.spines[["top", "right"]].set_visible(False)


def _rows(summary: pd.DataFrame, suite: str, variant: str) -> pd.DataFrame:
    chosen = summary[(summary["suite"] == suite) & (summary["variant"] == variant)]
    return chosen.sort_values("mass")


def _paper_curve(axes: Axes, suite: str, variant: str, error: int | None, colour: str, marker: str) -> None:
    points = [
        (mass, float(error_norm(np.array(errors))) if error is None else errors[error])
        for mass, row in TABLES[suite].items()
        if (errors := row.get(variant)) is not None
    ]
    if points:
        masses, values = zip(*points, strict=True)
        axes.plot(masses, values, color=colour, marker=marker, markersize=5, linestyle=":", markerfacecolor="none")


def _mark_survivors(axes: Axes, rows: pd.DataFrame, variant: str, variants: list[str]) -> None:
    """At the panel's upper edge, one line a variant: how many survived a mass where not all did, a cross for none."""
    colour, transform = style_of(variant, variants)[0], axes.get_xaxis_transform()
    height = 0.98 - FAILURE_SPACING * variants.index(variant)
    failed = rows[rows["survived"] == 0]["mass"]
    marks: list[Artist] = [
        *axes.plot(failed, [height] * len(failed), "x", color=colour, transform=transform, clip_on=False, markersize=6)
    ]
    for row in rows[(rows["survived"] > 0) & (rows["survived"] < rows["trials"])].itertuples():
        text = f"{row.survived}/{row.trials}"
        marks.append(
            axes.text(
                float(row.mass), height, text, color=colour, transform=transform, ha="center", va="center", fontsize=7
            )
        )
    for mark in marks:
        mark.set_in_layout(False)


def _still_line(axes: Axes, value: float) -> None:
    """What a robot that stands still scores."""
    axes.axhline(value, label=STANDS_STILL, zorder=0, color=STILL_COLOUR, linestyle="--", linewidth=1.2)
    axes.update_datalim([(0.0, value)], updatex=False)


def letter(panels: list[Axes]) -> None:
    """Letters before the titles of panels."""
    for axes, letter in zip(panels, ascii_lowercase, strict=False):
        axes.set_title(f"({letter}) {axes.get_title()}", fontsize=10)


def broken(text: str) -> str:
    """A long name on several lines."""
    return textwrap.fill(text, LABEL_WIDTH)


def legend(figure: Figure, axes: Axes) -> None:
    """One legend below all panels, with what a panel shows."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=9, ncols=len(labels), loc="outside lower center", frameon=False)


def tidy(axes: Axes) -> None:
    """From zero, with a grid, without a frame."""
    _from_zero(axes)
    axes.grid(True, color="0.9")
    axes.spines[["top", "right"]].set_visible(False)


def _from_zero(axes: Axes) -> None:
    """The vertical axis from 0 to above the highest point, so that its marker, bar label and interval are whole."""
    highest = axes.dataLim.ymax
    axes.set_ylim(0.0, (1.0 + HEADROOM) * highest if np.isfinite(highest) and highest > 0 else 1.0)
