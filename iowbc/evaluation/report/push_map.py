"""Table and figure of pushes over a grid of rolling resistances and masses."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iowbc.evaluation.report.aggregate import variants_of
from iowbc.evaluation.report.captions import measures, partner, trainings
from iowbc.evaluation.report.figures import letter
from iowbc.evaluation.report.tables import ABSENT, FAILS, Table

MAP = "map"
PANELS = {
    "rate": ("success", "viridis", (0.0, 1.0)),
    "E_v": ("E_v [m/s]", "viridis_r", (0.0, 0.5)),
    "push_force": ("push force [N]", "magma", (0.0, None)),
}
"""Columns that are drawn: title, colours, and range; the force up to the largest."""
PANEL = (4.2, 2.9)
"""Width and height of a panel [inch]."""
DARK = 0.55
"""Brightness of a cell below which its number is white."""


def map_table(summary: pd.DataFrame) -> Table:
    """A row for each rolling resistance and variant, a column for each mass."""
    chosen = summary[summary["kind"] == MAP]
    masses = sorted(chosen["mass"].unique())
    rows = []
    for resistance, group in chosen.groupby("rolling_resistance"):
        for variant in variants_of(group):
            cells = group[group["variant"] == variant].set_index("mass").reindex(masses)
            rows.append((f"μ {resistance:g}", variant, *(_cell(row) for _, row in cells.iterrows())))
    head = ("Rolling resistance", "Algorithm", *(f"{mass:g} kg" for mass in masses))
    caption = (
        "Pushes by rolling resistance and mass: trials that succeeded, E_v / E_v raw [m/s], mean horizontal force of "
        "the hands along the command [N]; means over surviving trials. A crate resists with μ m g, and in the paper's "
        f"tests μ is unknown. {FAILS}: no trial survived. In simulation, {partner(chosen)}. {measures(chosen)}"
        f"{trainings(chosen)}"
    )
    return Table("push_map", caption, head, head, tuple(rows), chosen)


def map_figure(summary: pd.DataFrame) -> Figure:
    """A row of heat maps for each variant: success, E_v, push force."""
    chosen = summary[summary["kind"] == MAP]
    variants = variants_of(chosen)
    figure = Figure(figsize=(PANEL[0] * len(PANELS), PANEL[1] * len(variants) + 0.4), layout="constrained")
    grid = figure.subplots(len(variants), len(PANELS), squeeze=False)
    for row, variant in zip(grid, variants, strict=True):
        own = chosen[chosen["variant"] == variant]
        for axes, (column, (title, colours, (low, high))) in zip(row, PANELS.items(), strict=True):
            values = own.pivot_table(index="rolling_resistance", columns="mass", values=column, dropna=False)
            largest = float(chosen[column].max()) if high is None else high
            _heat_map(axes, values, colours, (low, largest if largest > low else low + 1.0))
            axes.set_title(f"{variant}: {title}")
    letter(list(grid.flat))
    figure.suptitle("pushes; E_v and force: means over surviving trials, empty where none survived", fontsize=9)
    return figure


def _heat_map(axes: Axes, values: pd.DataFrame, colours: str, ends: tuple[float, float]) -> None:
    """Cells with their numbers; the lowest rolling resistance below."""
    table = values.to_numpy(np.float64)
    image = axes.imshow(table, origin="lower", aspect="auto", cmap=colours, vmin=ends[0], vmax=ends[1])
    places = 0 if ends[1] > 10 else 2
    for (below, along), value in np.ndenumerate(table):
        if np.isfinite(value):
            brightness = float(np.mean(image.cmap(image.norm(value))[:3]))
            colour = "white" if brightness < DARK else "black"
            axes.text(along, below, f"{value:.{places}f}", ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(range(table.shape[1]), [f"{mass:g}" for mass in values.columns])
    axes.set_yticks(range(table.shape[0]), [f"{resistance:g}" for resistance in values.index])
    axes.set_xlabel("mass [kg]")
    axes.set_ylabel("rolling resistance μ")


def _cell(row: pd.Series) -> str:
    if np.isnan(row["trials"]):
        return ABSENT
    counts = f"{row['succeeded']:.0f}/{row['trials']:.0f}"
    if not row["survived"]:
        return f"{counts}, {FAILS}"
    return f"{counts}, {row['E_v']:.3f} / {row['E_v_raw']:.3f}, {row['push_force']:.0f}"
