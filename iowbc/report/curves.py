"""Interactive curves as plotly's own plain figures: learning curves over steps, errors over masses."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.learning.curve_titles import title_of
from iowbc.learning.curves import TABLE
from iowbc.report.runs import Group
from iowbc.stages.registry import STAGES

Values = NDArray[np.float64]

MOST_POINTS = 400
"""Points of a curve; a longer one is averaged over neighbours."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#b8860b", "#56b4e9")
"""Colours that colour-blind readers tell apart (Okabe and Ito), one for each group."""
BAND = "33"
"""Opacity of a band, as the last two digits of its colour."""
ERRORS = {
    "rate": "success rate",
    "E_v": "E_v [m/s]",
    "E_psi": "E_ψ [rad]",
    "E_alpha": "E_α [rad]",
    "E_h": "E_h [m]",
}
SWEPT = 2
"""Masses from which on a suite has a curve."""


@dataclass
class Panel:
    """One small figure."""

    title: str
    traces: list[dict[str, Any]] = field(default_factory=list)
    across: str = "million environment steps"
    from_zero: bool = False
    """Whether the upright axis begins at 0, so that heights compare."""

    @property
    def figure(self) -> dict[str, Any]:
        """What plotly draws, which takes markup in its texts; the page adds the colours of light and dark."""
        layout: dict[str, Any] = {
            "title": {"text": escape(self.title, quote=False), "font": {"size": 14}},
            "xaxis": {"title": {"text": self.across}},
            "yaxis": {"rangemode": "tozero"} if self.from_zero else {},
        }
        traces = [{**trace, "name": escape(trace["name"], quote=False)} for trace in self.traces]
        return {"data": traces, "layout": layout}


def learning_panels(
    groups: Sequence[Group], stage: str, most_points: int = MOST_POINTS
) -> tuple[list[Panel], list[Panel]]:
    """The main learning curves of a stage, and all others; one of more than `most_points` is averaged to that many."""
    found = [
        [_columns(run.artifacts[stage].folder) for run in group.runs if stage in run.artifacts] for group in groups
    ]
    names = dict.fromkeys(name for group in found for columns in group for name in columns if name != "step")
    first = STAGES[stage].presentation.curves
    panels = {name: Panel(title_of(name)) for name in dict.fromkeys([*first, *names]) if name in names}
    for name, panel in panels.items():
        for place, (group, runs) in enumerate(zip(groups, found, strict=True)):
            having = [columns for columns in runs if name in columns]
            curves = [_thinned(columns["step"] / 1e6, columns[name], most_points) for columns in having]
            panel.traces += _band(group.label, place, *_joined(curves)) if curves else []
    return [panel for name, panel in panels.items() if name in first], [
        panel for name, panel in panels.items() if name not in first
    ]


def evaluation_panels(groups: Sequence[Group]) -> list[Panel]:
    """Success and errors over the mass, for each suite that sweeps it."""
    panels: dict[tuple[str, str], Panel] = {}
    for place, group in enumerate(groups):
        folders = [run.artifacts["eval"].folder for run in group.runs if "eval" in run.artifacts]
        for suite in dict.fromkeys(suite for folder in folders for suite in _suites(folder)):
            sweeps = [found[suite] for folder in folders if suite in (found := _suites(folder))]
            for name, title in ERRORS.items():
                curves = [sweep[name] for sweep in sweeps]
                joined = _joined([curve[:2] for curve in curves]) if len(curves) > 1 else curves[0]
                panel = panels.setdefault((suite, name), Panel(f"{suite}: {title}", across="mass [kg]", from_zero=True))
                panel.traces += _band(group.label, place, *joined, mode="lines+markers")
    return list(panels.values())


def _columns(folder: Path) -> dict[str, Values]:
    """The columns of an artifact's learning curves; a value that a row lacks is NaN."""
    rows = _rows(folder / TABLE)
    return {name: _numbers(rows, name) for name in rows[0]} if rows and "step" in rows[0] else {}


def _rows(path: Path) -> list[dict[str, str]]:
    """The rows of a table of numbers and names, without cells that have no name; none where it is not there."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        return [{name: cell or "" for name, cell in row.items() if name} for row in csv.DictReader(file)]


def _suites(folder: Path) -> dict[str, dict[str, tuple[Values, Values, Values, Values]]]:
    """By suite that sweeps the mass, and by error: masses, means, and both ends of the interval.

    An error is no less than 0, nor is its interval; a mean over one trial has none, its ends are NaN.
    """
    rows = [row for row in _rows(folder / "tables" / "summary.csv") if np.isfinite(_number(row.get("mass")))]
    found = {}
    for suite in dict.fromkeys(row.get("suite", "") for row in rows):
        own = [row for row in rows if row.get("suite") == row.get("case") == suite]
        own.sort(key=lambda row: _number(row["mass"]))
        mass = _numbers(own, "mass")
        if len(set(mass)) < SWEPT:
            continue
        found[suite] = {"rate": (mass, _numbers(own, "rate"), _numbers(own, "rate_low"), _numbers(own, "rate_high"))}
        for name in list(ERRORS)[1:]:
            mean, half = _numbers(own, name), _numbers(own, f"{name}_half")
            found[suite][name] = mass, mean, np.clip(mean - half, 0.0, None), mean + half
    return found


def _numbers(rows: Sequence[Mapping[str, str]], name: str) -> Values:
    return np.array([_number(row.get(name)) for row in rows])


def _number(text: str | None) -> float:
    """What a cell says, NaN where it says no number."""
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")


def _thinned(across: Values, values: Values, most_points: int) -> tuple[Values, Values]:
    """A curve of few points: means of neighbours, without what is missing."""
    known = np.isfinite(values)
    across, values = across[known], values[known]
    if len(values) <= most_points:
        return across, values
    parts = [np.array_split(row, most_points) for row in (across, values)]
    return np.array([part.mean() for part in parts[0]]), np.array([part.mean() for part in parts[1]])


def _joined(curves: Sequence[tuple[Values, Values]]) -> tuple[Values, Values, Values, Values]:
    """Mean, least and greatest of several curves, over the part of the axis that all of them have."""
    longest = max(curves, key=lambda curve: len(curve[0]))[0]
    curves = [curve for curve in curves if len(curve[0])]
    if not curves:
        return longest, longest, longest, longest
    common = longest[(longest >= max(c[0][0] for c in curves)) & (longest <= min(c[0][-1] for c in curves))]
    values = np.stack([np.interp(common, *curve) for curve in curves])
    return common, values.mean(axis=0), values.min(axis=0), values.max(axis=0)


def _band(
    label: str, place: int, across: Values, mean: Values, low: Values, high: Values, mode: str = "lines"
) -> list[dict[str, Any]]:
    """A line, and behind it the band between two others where they differ; a gap of the band is left open."""
    colour = COLOURS[place % len(COLOURS)]
    shown = {"name": label, "legendgroup": label, "x": _plain(across)}
    traces: list[dict[str, Any]] = []
    known = np.isfinite(low) & np.isfinite(high)
    if not np.array_equal(low[known], high[known]):
        hidden = {"mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
        ends = np.flatnonzero(np.diff(known)) + 1
        for part in (part for part in np.split(np.arange(len(known)), ends) if known[part[0]]):
            edge = {**shown, **hidden, "x": _plain(across[part])}
            traces += [
                {**edge, "y": _plain(low[part])},
                {**edge, "y": _plain(high[part]), "fill": "tonexty", "fillcolor": colour + BAND},
            ]
    return [*traces, {**shown, "y": _plain(mean), "mode": mode, "line": {"color": colour, "width": 2}}]


def _plain(values: Values) -> list[float | None]:
    """Numbers for JSON, of six digits; what is no number is left out of a line."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
