"""Tables and figure of the interaction with a partner: forces, work, velocity errors, mechanical impedance."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iowbc.evaluation.report.aggregate import variants_of
from iowbc.evaluation.report.captions import partner, trainings
from iowbc.evaluation.report.columns import (
    IDLE,
    SUCCESS,
    SURVIVED,
    Entry,
    by_case,
    mean_entry,
    still_error,
    variant_rows,
    variant_table,
)
from iowbc.evaluation.report.figures import draw_bars, finish, line_labels, style_of, tidy
from iowbc.evaluation.trials.interaction import apparent
from iowbc.results.table import ABSENT, FAILS, Cell, Column, Table, measured

BLOCKED_BEFORE = {"IO-WBC": (113, 231), "w/o Distill.": (73, 109)}
"""Range of peak hand forces on a blocked crate [N], of the first published controllers, trained without a bound."""


def _force(head: str, name: str) -> Entry:
    def cell(row: pd.Series) -> str:
        sizes = [float(row[f"{name}_{part}"]) for part in ("mean", "p95", "peak")]
        return ABSENT if np.isnan(sizes).any() else " / ".join(f"{size:.0f}" for size in sizes)

    return Entry(Column(head), cell)


def _velocity(head: str, name: str) -> Entry:
    still = (lambda rows: ABSENT) if name == "E_v_partner" else lambda rows: still_error(rows, "E_v")
    return Entry(Column(head), lambda row: measured(row[name], none=ABSENT if row["survived"] else FAILS), still)


INTERACTION = (
    SURVIVED,
    Entry(Column("Success"), SUCCESS.cell, lambda rows: "none"),
    _force("Handle force [N]", "handle_force"),
    _force("Hand force [N]", "hand_force"),
    mean_entry("Work on partner [J]", "partner_work", "+.1f"),
    _velocity("E_v [m/s]", "E_v"),
    _velocity("E_v raw [m/s]", "E_v_raw"),
    _velocity("E_v partner [m/s]", "E_v_partner"),
)
IMPEDANCE = (
    SURVIVED,
    Entry(Column("Impedance [N·s/m]"), lambda row: measured(abs(_value(row)), form=".0f", none=FAILS)),
    Entry(Column("Phase [°]"), lambda row: measured(np.degrees(np.angle(_value(row))), form="+.0f", none=FAILS)),
)
FITTED = {"Stiffness [N/m]": ".0f", "Damping [N·s/m]": ".0f", "Mass [kg]": ".1f"}
"""Columns of `apparent` with their number format."""


def compliance_table(summary: pd.DataFrame) -> Table:
    """Forces, work and errors of each variant for each partner behaviour and for a blocked crate."""
    chosen = summary[summary["kind"] == "compliance"]
    before = ", ".join(f"{variant} {low} to {high} N" for variant, (low, high) in BLOCKED_BEFORE.items())
    caption = (
        "Interaction with partners of different behaviour. Forces are horizontal: mean / 95th percentile / peak over a "
        "trial, at the partner's handle and at the more loaded hand; work: horizontal, done on the partner; means over "
        "all trials until their end. E_v: averaged over a gait period, and raw; E_v partner: error of the handle's "
        "velocity from the one that the partner intends; means over surviving trials. "
        f"{FAILS}: none survived. {IDLE} Peak force of a hand on a blocked crate, of the first published controllers: "
        f"{before}. In simulation, undisturbed, {partner(chosen)}."
        f"{trainings(chosen)}"
    )
    rows = variant_rows(INTERACTION, by_case(chosen), still=True)
    return variant_table("compliance", caption, "Partner", INTERACTION, rows, chosen)


def impedance_table(summary: pd.DataFrame) -> Table:
    """Mechanical impedance by direction and frequency of the pull, and the fitted mass, spring and damper."""
    chosen = summary[summary["kind"] == "impedance"]
    entries = (*IMPEDANCE, *(Entry(Column(head), lambda row: ABSENT) for head in FITTED))
    rows: list[tuple[Cell, ...]] = []
    numbers = []
    for direction, within in chosen.groupby("pull_direction", sort=False):
        pulls = within.groupby("pull_frequency")
        rows += variant_rows(entries, [(f"{direction}, {frequency:g} Hz", group) for frequency, group in pulls])
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
    return variant_table("impedance", caption, "Pull", entries, rows, fitted)


def compliance_figure(summary: pd.DataFrame) -> Figure:
    """Forces at handle and hands and velocity error to the partner by partner behaviour, and the impedance."""
    behaviours = summary[summary["kind"] == "compliance"]
    figure = Figure(figsize=(11.0, 7.0), layout="constrained")
    panels = list(figure.subplots(2, 2).flat)
    _behaviour_bars(panels[0], behaviours, "handle_force_p95", "horizontal force at the handle, p95 [N]")
    _behaviour_bars(panels[1], behaviours, "hand_force_p95", "horizontal force at a hand, p95 [N]")
    _behaviour_bars(panels[2], behaviours, "E_v_partner", "handle against partner [m/s]")
    _impedance_curves(panels[3], summary[summary["kind"] == "impedance"], variants_of(summary))
    title = "forces: means over all trials, whiskers: peaks; (c), (d): over surviving trials, × none"
    return finish(figure, panels, title, panels[0] if len(behaviours) else panels[3])


def _behaviour_bars(axes: Axes, chosen: pd.DataFrame, column: str, title: str) -> None:
    """Bars of a column by case, or a cross if no trial survived; whiskers up to the peak of a force."""
    axes.set_title(title)
    keys = ["suite", "case", "mass"]
    force = column.endswith("_p95")
    met = chosen[chosen[column if force else "handle_force_p95"].notna()]
    names = list(dict.fromkeys(met[keys].itertuples(index=False, name=None)))
    heights, texts, intervals = {}, {}, {}
    for variant in variants_of(chosen):
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
