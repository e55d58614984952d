"""Table and figure of pushes over a grid of rolling resistances and masses."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from iowbc.evaluation.report.aggregate import variants_of
from iowbc.evaluation.report.captions import measures, partner, trainings
from iowbc.evaluation.report.figures import finish
from iowbc.results.table import ABSENT, FAILS, Table, heads

MAP = "map"
PANELS = {
    "rate": ("success", "viridis", 1.0),
    "E_v": ("E_v [m/s]", "viridis_r", 0.5),
    "push_force": ("push force [N]", "magma", None),
}
"""Columns to plot: title, colour map and upper end of the range from 0; None: the largest value."""
DARK = 0.55
"""Brightness of a cell below which its number is white."""


def map_table(summary: pd.DataFrame) -> Table:
    """Table with a row per rolling resistance and variant and a column per mass."""
    chosen = summary[summary["kind"] == MAP]
    masses = sorted(chosen["mass"].unique())
    rows = []
    for resistance, group in chosen.groupby("rolling_resistance"):
        for variant in variants_of(group):
            cells = group[group["variant"] == variant].set_index("mass").reindex(masses)
            rows.append((f"μ {resistance:g}", variant, *(_cell(row) for _, row in cells.iterrows())))
    columns = heads("Rolling resistance", "Algorithm", *(f"{mass:g} kg" for mass in masses))
    caption = (
        "Pushes by rolling resistance and mass: trials that succeeded, E_v / E_v raw [m/s], mean horizontal force of "
        "the hands along the command [N]; means over surviving trials. A crate resists with μ m g; the paper's "
        f"μ is unknown. {FAILS}: no trial survived. In simulation, {partner(chosen)}. {measures(chosen)}"
        f"{trainings(chosen)}"
    )
    return Table("push_map", caption, columns, rows, chosen)


def map_figure(summary: pd.DataFrame) -> Figure:
    """One row of heat maps per variant: success, E_v, push force; rolling resistance increases upwards."""
    chosen = summary[summary["kind"] == MAP]
    variants = variants_of(chosen)
    figure = Figure(figsize=(4.2 * len(PANELS), 2.9 * len(variants) + 0.4), layout="constrained")
    panels = list(figure.subplots(len(variants), len(PANELS), squeeze=False).flat)
    places = [(variant, column) for variant in variants for column in PANELS]
    for axes, (variant, column) in zip(panels, places, strict=True):
        title, colours, high = PANELS[column]
        own = chosen[chosen["variant"] == variant]
        values = own.pivot_table(index="rolling_resistance", columns="mass", values=column, dropna=False)
        high = high or float(chosen[column].max())
        high = high if high > 0.0 else 1.0
        image = axes.imshow(values, origin="lower", aspect="auto", cmap=colours, vmin=0.0, vmax=high)
        for (below, along), value in np.ndenumerate(values.to_numpy(np.float64)):
            if np.isfinite(value):
                dark = float(np.mean(image.cmap(image.norm(value))[:3])) < DARK
                text = {"ha": "center", "va": "center", "fontsize": 7, "color": "white" if dark else "black"}
                axes.text(along, below, f"{value:.{0 if high > 10 else 2}f}", **text)
        axes.set_xticks(range(values.shape[1]), [f"{mass:g}" for mass in values.columns])
        axes.set_yticks(range(values.shape[0]), [f"{resistance:g}" for resistance in values.index])
        axes.set(title=f"{variant}: {title}", xlabel="mass [kg]", ylabel="rolling resistance μ")
    return finish(figure, panels, "pushes; E_v and force: means over surviving trials, empty where none survived")


def _cell(row: pd.Series) -> str:
    if np.isnan(row["trials"]):
        return ABSENT
    counts = f"{row['succeeded']:.0f}/{row['trials']:.0f}"
    if not row["survived"]:
        return f"{counts}, {FAILS}"
    return f"{counts}, {row['E_v']:.3f} / {row['E_v_raw']:.3f}, {row['push_force']:.0f}"
