"""Learning curves over steps and errors over masses, which a page draws with plotly and a picture with matplotlib."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from iowbc.learning.curves import TABLE, title_of
from iowbc.report.runs import Group
from iowbc.results.picture import COLOURS
from iowbc.stages.registry import STAGES

Values = NDArray[np.float64]

MOST_POINTS = 400
"""Points of a curve; a longer one is averaged over neighbours."""
STEPS = "million environment steps"
BAND = 0.2
ERRORS = {"rate": "success rate", "E_v": "E_v [m/s]", "E_psi": "E_ψ [rad]", "E_alpha": "E_α [rad]", "E_h": "E_h [m]"}
SWEPT = 2
"""Minimum number of masses for a curve of a suite."""
PICTURE_POINTS = 120
"""Points of a curve in a picture, where noise cannot be zoomed into."""
COLUMNS = 3
"""Number of panels per row of a picture."""
PANEL_SIZE = (4.0, 2.6)
"""Width and height of a panel of a picture [inch]."""


@dataclass(frozen=True)
class Curve:
    """A line with a band; unknown values are NaN."""

    label: str
    colour: str
    across: Values
    mean: Values
    low: Values
    high: Values

    @property
    def banded(self) -> NDArray[np.bool_]:
        """Points with a band: none if it has no width."""
        known = np.isfinite(self.low) & np.isfinite(self.high)
        return known & (not np.array_equal(self.low[known], self.high[known]))

    def traces(self, mode: str) -> list[dict[str, Any]]:
        """Traces for plotly: the edges of each unbroken part of the band, then the line."""
        shown = {"name": escape(self.label, quote=False), "legendgroup": self.label}
        edge = {**shown, "mode": "lines", "line": {"width": 0}, "showlegend": False, "hoverinfo": "skip"}
        fill = {"fill": "tonexty", "fillcolor": f"{self.colour}{round(255 * BAND):02x}"}
        found: list[dict[str, Any]] = []
        banded = self.banded
        for part in np.split(np.arange(len(banded)), np.flatnonzero(np.diff(banded)) + 1):
            if banded[part].any():
                across = {"x": _plain(self.across[part])}
                found += [edge | across | {"y": _plain(self.low[part])}]
                found += [edge | across | {"y": _plain(self.high[part])} | fill]
        line = {"mode": mode, "line": {"color": self.colour, "width": 2}}
        return [*found, {**shown, "x": _plain(self.across), "y": _plain(self.mean), **line}]


@dataclass
class CurvePanel:
    title: str
    over_mass: bool = False
    """True over the mass, with marks and an upright axis that begins at 0, so that heights compare; else over steps."""
    curves: list[Curve] = field(default_factory=list)

    @property
    def figure(self) -> dict[str, Any]:
        """The figure for plotly, which takes markup in its texts; the page adds the colours of light and dark."""
        layout: dict[str, Any] = {
            "title": {"text": escape(self.title, quote=False), "font": {"size": 14}},
            "xaxis": {"title": {"text": "mass [kg]" if self.over_mass else STEPS}},
            "yaxis": {"rangemode": "tozero"} if self.over_mass else {},
        }
        mode = "lines+markers" if self.over_mass else "lines"
        return {"data": [trace for curve in self.curves for trace in curve.traces(mode)], "layout": layout}


def learning_panels(
    groups: Sequence[Group], stage: str, most_points: int = MOST_POINTS
) -> tuple[list[CurvePanel], list[CurvePanel]]:
    """The main learning curves of a stage, and all others; one of more than `most_points` is averaged to that many."""
    found = [
        [_columns(run.artifacts[stage].folder) for run in group.runs if stage in run.artifacts] for group in groups
    ]
    names = dict.fromkeys(name for group in found for columns in group for name in columns if name != "step")
    first = STAGES[stage].curves
    panels = {name: CurvePanel(title_of(name)) for name in dict.fromkeys([*first, *names]) if name in names}
    for name, panel in panels.items():
        for colour, group, runs in zip(cycle(COLOURS), groups, found, strict=False):
            having = [columns for columns in runs if name in columns]
            curves = [_thinned(columns["step"] / 1e6, columns[name], most_points) for columns in having]
            panel.curves += [Curve(group.label, colour, *_joined(curves))] if curves else []
    main = [panel for name, panel in panels.items() if name in first]
    return main, [panel for name, panel in panels.items() if name not in first]


def evaluation_panels(groups: Sequence[Group]) -> list[CurvePanel]:
    """Success and errors over the mass, for each suite that sweeps it."""
    panels: dict[tuple[str, str], CurvePanel] = {}
    for colour, group in zip(cycle(COLOURS), groups, strict=False):
        found = [_suites(run.artifacts["eval"].folder) for run in group.runs if "eval" in run.artifacts]
        for suite in dict.fromkeys(suite for suites in found for suite in suites):
            for name, title in ERRORS.items():
                curves = [suites[suite][name] for suites in found if suite in suites]
                joined = _joined([curve[:2] for curve in curves]) if len(curves) > 1 else curves[0]
                panel = panels.setdefault((suite, name), CurvePanel(f"{suite}: {title}", over_mass=True))
                panel.curves.append(Curve(group.label, colour, *joined))
    return list(panels.values())


def learning_figure(panels: Sequence[CurvePanel], title: str) -> Figure:
    """Panels of `learning_panels` side by side: a line for each group, a band from its least to its greatest seed."""
    lines = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(PANEL_SIZE[0] * COLUMNS, PANEL_SIZE[1] * lines), layout="constrained")
    figure.suptitle(title)
    labels: dict[str, Any] = {}
    for position, panel in enumerate(panels, 1):
        axes = figure.add_subplot(lines, COLUMNS, position)
        for one in panel.curves:
            (labels[one.label],) = axes.plot(one.across, one.mean, color=one.colour, linewidth=1.3)
            if one.banded.any():
                edges = (one.across, one.low, one.high)
                axes.fill_between(*edges, where=one.banded, color=one.colour, alpha=BAND, linewidth=0)
        axes.set_title(panel.title, fontsize=9)
        axes.set_xlabel(STEPS, fontsize=8)
        axes.tick_params(labelsize=8)
        axes.grid(alpha=0.3)
    figure.legend(labels.values(), labels.keys(), loc="outside lower center", ncols=5, fontsize=9, frameon=False)
    return figure


def _columns(folder: Path) -> dict[str, Values]:
    """The columns of an artifact's learning curves; a value that a row lacks is NaN."""
    table = pd.read_parquet(folder / TABLE) if (folder / TABLE).is_file() else pd.DataFrame()
    return {name: np.asarray(table[name], np.float64) for name in table.select_dtypes("number") if "step" in table}


def _suites(folder: Path) -> dict[str, dict[str, tuple[Values, Values, Values, Values]]]:
    """Masses, means, and both ends of the interval, NaN where unknown, by suite that varies the mass and by error;
    intervals of errors are clipped at 0."""
    file = folder / "tables" / "summary.csv"
    try:
        rows = pd.read_csv(file, dtype=str, encoding_errors="replace", index_col=False)
    except (FileNotFoundError, pd.errors.EmptyDataError, pd.errors.ParserError):
        return {}
    if not {"suite", "case", "mass"} <= {*rows}:
        return {}
    _, *errors = ERRORS
    wanted = ["mass", "rate", "rate_low", "rate_high", *errors, *(f"{name}_half" for name in errors)]
    numbers = rows.reindex(columns=wanted).apply(pd.to_numeric, errors="coerce").astype(np.float64)
    swept = numbers[rows["suite"] == rows["case"]].dropna(subset="mass").sort_values("mass", kind="stable")
    found = {}
    for suite, own in swept.groupby(rows["suite"], sort=False):
        if own["mass"].nunique() >= SWEPT:
            mass, rate, low, high, *_ = own.to_numpy().T
            found[suite] = {"rate": (mass, rate, low, high)}
            for name in errors:
                mean, half = own[[name, f"{name}_half"]].to_numpy().T
                found[suite][name] = mass, mean, np.clip(mean - half, 0.0, None), mean + half
    return found


def _thinned(across: Values, values: Values, most_points: int) -> tuple[Values, Values]:
    """A curve reduced to `most_points` means of neighbours, without missing values."""
    known = np.isfinite(values)
    across, values = across[known], values[known]
    if len(values) <= most_points:
        return across, values
    thinned = [np.array([part.mean() for part in np.array_split(row, most_points)]) for row in (across, values)]
    return thinned[0], thinned[1]


def _joined(curves: Sequence[tuple[Values, Values]]) -> tuple[Values, Values, Values, Values]:
    """Mean, least and greatest of several curves, over the part of the axis that all of them have."""
    longest = max(curves, key=lambda curve: len(curve[0]))[0]
    curves = [curve for curve in curves if len(curve[0])]
    if not curves:
        return longest, longest, longest, longest
    common = longest[(longest >= max(c[0][0] for c in curves)) & (longest <= min(c[0][-1] for c in curves))]
    values = np.stack([np.interp(common, *curve) for curve in curves])
    return common, values.mean(axis=0), values.min(axis=0), values.max(axis=0)


def _plain(values: Values) -> list[float | None]:
    """Numbers for JSON, rounded to six digits; None for non-finite values."""
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
