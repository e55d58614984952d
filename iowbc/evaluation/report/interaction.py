"""Tables and figures of interaction: forces, work, velocity errors and impedance with partners; pushes by friction."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iowbc.evaluation.report import columns
from iowbc.evaluation.report.aggregate import variants_of
from iowbc.evaluation.report.captions import measures, partner, trainings
from iowbc.evaluation.report.figures import draw_bars, finish, line_labels, style_of, tidy
from iowbc.evaluation.trials.interaction import apparent
from iowbc.results.table import ABSENT, FAILS, Cell, Table, heads, measured

BLOCKED_BEFORE = "IO-WBC 113 to 231 N, w/o Distill. 73 to 109 N"
"""Range of peak hand forces on a blocked crate, of the first published controllers, trained without a bound."""


def _force(head: str, name: str) -> columns.Entry:
    def cell(row: pd.Series) -> str:
        sizes = [float(row[f"{name}_{part}"]) for part in ("mean", "p95", "peak")]
        return ABSENT if np.isnan(sizes).any() else " / ".join(f"{size:.0f}" for size in sizes)

    return columns.Entry(head, cell)


def _velocity(head: str, name: str) -> columns.Entry:
    still = (lambda rows: ABSENT) if name == "E_v_partner" else lambda rows: columns.still_error(rows, "E_v")
    return columns.Entry(head, lambda row: measured(row[name], none=ABSENT if row["survived"] else FAILS), still)


INTERACTION = (
    columns.SURVIVED,
    columns.Entry("Success", columns.SUCCESS.cell, lambda rows: "none"),
    _force("Handle force [N]", "handle_force"),
    _force("Hand force [N]", "hand_force"),
    columns.mean_entry("Work on partner [J]", "partner_work", "+.1f"),
    _velocity("E_v [m/s]", "E_v"),
    _velocity("E_v raw [m/s]", "E_v_raw"),
    _velocity("E_v partner [m/s]", "E_v_partner"),
)
IMPEDANCE = (
    columns.SURVIVED,
    columns.Entry("Impedance [N·s/m]", lambda row: measured(abs(_value(row)), form=".0f", none=FAILS)),
    columns.Entry("Phase [°]", lambda row: measured(np.degrees(np.angle(_value(row))), form="+.0f", none=FAILS)),
)
FITTED = {"Stiffness [N/m]": ".0f", "Damping [N·s/m]": ".0f", "Mass [kg]": ".1f"}
"""Columns of `apparent` with their number format."""
MAP = "map"
PANELS = {
    "rate": ("success", "viridis", 1.0),
    "E_v": ("E_v [m/s]", "viridis_r", 0.5),
    "push_force": ("push force [N]", "magma", None),
}
"""Columns to plot: title, colour map and upper end of the range from 0; None: the largest value."""
DARK = 0.55
"""Brightness of a cell below which its number is white."""


def compliance_table(summary: pd.DataFrame) -> Table:
    """Forces, work and errors of each variant for each partner behaviour and for a blocked crate."""
    chosen = summary[summary["kind"] == "compliance"]
    caption = (
        "Interaction with partners of different behaviour. Forces are horizontal: mean / 95th percentile / peak over a "
        "trial, at the partner's handle and at the more loaded hand; work: horizontal, done on the partner; means over "
        "all trials until their end. E_v: averaged over a gait period, and raw; E_v partner: error of the handle's "
        "velocity from the one that the partner intends; means over surviving trials. "
        f"{FAILS}: none survived. {columns.IDLE} Peak force of a hand on a blocked crate, of the first published "
        f"controllers: {BLOCKED_BEFORE}. In simulation, undisturbed, {partner(chosen)}.{trainings(chosen)}"
    )
    rows = columns.variant_rows(INTERACTION, columns.by_case(chosen), still=True)
    return columns.variant_table("compliance", caption, "Partner", INTERACTION, rows, chosen)


def impedance_table(summary: pd.DataFrame) -> Table:
    """Mechanical impedance by direction and frequency of the pull, and the fitted mass, spring and damper."""
    chosen = summary[summary["kind"] == "impedance"]
    entries = (*IMPEDANCE, *(columns.Entry(head, lambda row: ABSENT) for head in FITTED))
    rows: list[tuple[Cell, ...]] = []
    numbers = []
    for direction, within in chosen.groupby("pull_direction", sort=False):
        pulls = within.groupby("pull_frequency")
        rows += columns.variant_rows(entries, [(f"{direction}, {frequency:g} Hz", group) for frequency, group in pulls])
        for variant in dict.fromkeys(within["variant"]):
            own = within[(within["variant"] == variant) & within["impedance_real"].notna()]
            if own.empty:
                continue
            values = np.array([_value(row) for _, row in own.iterrows()])
            fit = apparent(own["pull_frequency"].to_numpy(np.float64), values)
            cells = [measured(value, form=form) for value, form in zip(fit.values(), FITTED.values(), strict=True)]
            rows.append((f"{direction}, all", str(variant), *[ABSENT] * 3, *cells))
            numbers.append({"variant": variant, "pull_direction": direction} | fit)
    caption = (
        f"Mechanical impedance of the standing robot with an object of {float(chosen['mass'].iloc[0]):g} kg to small "
        "sinusoidal pulls on the object: force over velocity at the frequency of the pull, by least squares, mean over "
        "surviving trials. Phase: -90° a spring, 0° a damper, 90° a mass; beyond ±90° the robot adds energy. Below "
        "each direction: stiffness, damping and mass (including the object's), fitted to all frequencies. "
        f"In simulation, undisturbed, {partner(chosen)}.{trainings(chosen)}"
    )
    keys = ["variant", "pull_direction"]
    fitted = chosen.merge(pd.DataFrame(numbers), how="left", on=keys) if numbers else chosen
    return columns.variant_table("impedance", caption, "Pull", entries, rows, fitted)


def compliance_figure(summary: pd.DataFrame) -> Figure:
    """Forces at handle and hands and velocity error to the partner by partner behaviour, and the impedance."""
    behaviours = summary[summary["kind"] == "compliance"]
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    panels = list(figure.subplots(2, 2).flat)
    variants = variants_of(summary)
    _behaviour_bars(panels[0], behaviours, variants, "handle_force_p95", "horizontal force at the handle, p95 [N]")
    _behaviour_bars(panels[1], behaviours, variants, "hand_force_p95", "horizontal force at a hand, p95 [N]")
    _behaviour_bars(panels[2], behaviours, variants, "E_v_partner", "handle against partner [m/s]")
    _impedance_curves(panels[3], summary[summary["kind"] == "impedance"], variants)
    title = "forces: means over all trials, whiskers: peaks; (c), (d): over surviving trials, × none"
    return finish(figure, panels, title, panels[0] if len(behaviours) else panels[3])


def _behaviour_bars(axes: Axes, chosen: pd.DataFrame, variants: Sequence[str], column: str, title: str) -> None:
    """Bars of a column by case, or a cross if no trial survived; whiskers up to the peak of a force."""
    axes.set_title(title)
    keys = ["suite", "case", "mass"]
    force = column.endswith("_p95")
    met = chosen[chosen[column if force else "handle_force_p95"].notna()]
    names = list(dict.fromkeys(met[keys].itertuples(index=False, name=None)))
    heights, texts, intervals = {}, {}, {}
    for variant in variants:
        rows = chosen[chosen["variant"] == variant].set_index(keys).reindex(names)
        values = rows[column].to_numpy(np.float64)
        failed = np.isnan(values) & (rows["survived"].to_numpy(np.float64) == 0)
        heights[variant] = np.where(failed, 0.0, values)
        texts[variant] = ["×" if none else "" for none in failed]
        if force:
            above = rows[column.replace("_p95", "_peak")].to_numpy(np.float64) - heights[variant]
            intervals[variant] = np.stack([np.zeros(len(names)), np.nan_to_num(above).clip(0.0)])
    draw_bars(axes, heights, texts, line_labels([(case, mass) for _, case, mass in names]), intervals)


def _impedance_curves(axes: Axes, pulls: pd.DataFrame, variants: list[str]) -> None:
    """Magnitude over frequency, one curve per variant and direction; dashed except forward."""
    axes.set_title("mechanical impedance [N·s/m]; dashed: to the left")
    for (variant, direction), rows in pulls.groupby(["variant", "pull_direction"], sort=False):
        ordered = rows.sort_values("pull_frequency")
        size = np.hypot(ordered["impedance_real"], ordered["impedance_imag"])
        forward = direction == "forward"
        style = style_of(str(variant), variants) | {"linestyle": "-" if forward else "--"}
        axes.plot(ordered["pull_frequency"], size, label=str(variant) if forward else None, **style)
    axes.set_xlabel("frequency of the pull [Hz]")
    tidy(axes)
    if len(pulls):
        frequencies = sorted(pulls["pull_frequency"].unique())
        axes.set_xscale("log")
        axes.set_xticks(frequencies, [f"{frequency:g}" for frequency in frequencies])
        axes.set_xticks([], minor=True)


def _value(row: pd.Series) -> complex:
    return complex(row["impedance_real"], row["impedance_imag"])


def map_table(summary: pd.DataFrame) -> Table:
    """Table with a row per rolling resistance and variant and a column per mass."""
    chosen = summary[summary["kind"] == MAP]
    masses = sorted(chosen["mass"].unique())
    rows = []
    for resistance, group in chosen.groupby("rolling_resistance"):
        for variant in variants_of(group):
            cells = group[group["variant"] == variant].set_index("mass").reindex(masses)
            rows.append((f"μ {resistance:g}", variant, *(_map_cell(row) for _, row in cells.iterrows())))
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


def _map_cell(row: pd.Series) -> str:
    if np.isnan(row["trials"]):
        return ABSENT
    counts = f"{row['succeeded']:.0f}/{row['trials']:.0f}"
    if not row["survived"]:
        return f"{counts}, {FAILS}"
    return f"{counts}, {row['E_v']:.3f} / {row['E_v_raw']:.3f}, {row['push_force']:.0f}"
