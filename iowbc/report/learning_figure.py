"""The main learning curves of several runs as one picture, for papers and pages that nothing can be clicked in."""

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iowbc.report.curves import Panel

POINTS = 120
"""Points of a curve in the picture, where noise cannot be zoomed into."""
COLUMNS = 3
PANEL_SIZE = (4.0, 2.6)
"""Width and height of a panel [inch]."""
BAND_OPACITY = 0.2


def learning_figure(panels: Sequence[Panel], title: str) -> Figure:
    """Panels of `learning_panels` side by side: a line for each group, a band from its least to its greatest seed."""
    lines = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(PANEL_SIZE[0] * COLUMNS, PANEL_SIZE[1] * lines), layout="constrained")
    figure.suptitle(title)
    labels: dict[str, Any] = {}
    for position, panel in enumerate(panels, 1):
        axes = figure.add_subplot(lines, COLUMNS, position)
        labels |= _draw(axes, panel.traces)
        axes.set_title(panel.title, fontsize=9)
        axes.set_xlabel(panel.across, fontsize=8)
        axes.tick_params(labelsize=8)
        axes.grid(alpha=0.3)
    figure.legend(labels.values(), labels.keys(), loc="outside lower center", ncols=5, fontsize=9, frameon=False)
    return figure


def _draw(axes: Axes, traces: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Lines and bands of one panel; the lines by their groups' names."""
    lines = {}
    for before, trace in zip([None, *traces], traces, strict=False):
        if trace.get("showlegend", True):
            colour = trace["line"]["color"]
            y = [float("nan") if value is None else value for value in trace["y"]]
            (lines[trace["name"]],) = axes.plot(trace["x"], y, color=colour, linewidth=1.3)
        elif before is not None and "fill" in trace:
            colour = trace["fillcolor"][:-2]
            axes.fill_between(trace["x"], before["y"], trace["y"], color=colour, alpha=BAND_OPACITY, linewidth=0)
    return lines
