"""Tables and figure of the interaction with a partner: forces, work, whose motion is followed, mechanical impedance."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from iowbc.evaluation.report.aggregate import variants_of
from iowbc.evaluation.report.captions import partner, trainings
from iowbc.evaluation.report.error_tables import STANDS_STILL
from iowbc.evaluation.report.figures import Bars, broken, draw_bars, legend, letter, style_of, tidy
from iowbc.evaluation.report.tables import ABSENT, FAILS, Table
from iowbc.evaluation.trials.impedance import Apparent, apparent

BLOCKED_BEFORE = {"IO-WBC": (113, 231), "w/o Distill.": (73, 109)}
"""Peak forces of a hand on a blocked crate [N] over the trials of the first published controllers, which were trained
without a bound on them."""
SPREAD = ("mean", "p95", "peak")
FIGURE_SIZE = (11.0, 7.0)


def compliance_table(summary: pd.DataFrame) -> Table:
    """How each variant gets on with each behaviour of the partner, and before a crate that is blocked."""
    chosen = summary[summary["kind"] == "compliance"]
    rows = []
    for (_, case, mass), group in chosen.groupby(["suite", "case", "mass"], sort=False):
        name = f"{case} ({mass:g} kg)"
        rows += [(name, str(row["variant"]), *_interaction(row)) for _, row in group.iterrows()]
        still = f"{float(group['still_E_v'].mean()):.3f}"
        rows.append((name, STANDS_STILL, ABSENT, "none", *[ABSENT] * 3, still, still, ABSENT))
    head = (
        *("Partner", "Algorithm", "Survived", "Success", "Handle force [N]", "Hand force [N]", "Work on partner [J]"),
        *("E_v [m/s]", "E_v raw [m/s]", "E_v partner [m/s]"),
    )
    before = ", ".join(f"{variant} {low} to {high} N" for variant, (low, high) in BLOCKED_BEFORE.items())
    caption = (
        "Interaction with partners of different behaviour. Forces are horizontal: mean / 95th percentile / peak over a "
        "trial, at the partner's handle, and at the hand with more; work: horizontal, done on the partner; means over "
        "all trials up to their end. E_v against the command, averaged over a gait period and raw; E_v partner: "
        "velocity of the handle against the one that the partner intends; means over surviving trials. "
        f"{FAILS}: none survived. {STANDS_STILL}: what doing nothing scores, from the script. Peak force of a hand on "
        f"a blocked crate, of the first published controllers: {before}. In simulation, undisturbed, {partner(chosen)}."
        f"{trainings(chosen)}"
    )
    return Table("compliance", caption, head, head, tuple(rows), chosen)


def impedance_table(summary: pd.DataFrame) -> Table:
    """The mechanical impedance to pulls of each direction and frequency, and mass, spring and damper that have it."""
    chosen = summary[summary["kind"] == "impedance"]
    rows, numbers = [], []
    for direction, within in chosen.groupby("pull_direction", sort=False):
        for frequency, group in within.groupby("pull_frequency"):
            rows += [
                (f"{direction}, {frequency:g} Hz", str(row["variant"]), _survived(row), *_polar(_impedance(row)))
                for _, row in group.iterrows()
            ]
        for variant, found in fits(within):
            cells = (found.stiffness, found.damping, found.mass)
            said = [
                ABSENT if np.isnan(value) else f"{value:.{places}f}"
                for value, places in zip(cells, (0, 0, 1), strict=True)
            ]
            rows.append((f"{direction}, all", variant, ABSENT, ABSENT, ABSENT, *said))
            numbers.append(
                {"variant": variant, "pull_direction": direction, "stiffness": found.stiffness}
                | {"damping": found.damping, "mass_apparent": found.mass}
            )
    head = (
        *("Pull", "Algorithm", "Survived", "Impedance [N·s/m]", "Phase [°]"),
        *("Stiffness [N/m]", "Damping [N·s/m]", "Mass [kg]"),
    )
    caption = (
        f"Mechanical impedance of the standing robot with an object of {float(chosen['mass'].iloc[0]):g} kg to small "
        "sinusoidal pulls on the object: force over velocity at the frequency of the pull, by least squares, mean over "
        "surviving trials. Phase: -90° a spring, 0° a damper, 90° a mass; beyond ±90° the robot adds energy. Below "
        "each direction: the stiffness, damping and mass (with the object's) that fit all frequencies. In simulation, "
        f"undisturbed, {partner(chosen)}.{trainings(chosen)}"
    )
    keys = ["variant", "pull_direction"]
    told = chosen.merge(pd.DataFrame(numbers), how="left", on=keys) if numbers else chosen
    return Table("impedance", caption, head, head, tuple(rows), told)


def fits(within: pd.DataFrame) -> Iterator[tuple[str, Apparent]]:
    """Mass, spring and damper of each variant by the rows of one direction, where any trial survived."""
    for variant, rows in within.groupby("variant", sort=False):
        told = rows[rows["impedance_real"].notna()]
        if len(told):
            values = np.array([_impedance(row) for _, row in told.iterrows()])
            yield str(variant), apparent(told["pull_frequency"].to_numpy(np.float64), values)


def compliance_figure(summary: pd.DataFrame) -> Figure:
    """Forces at handle and hands and the deviation from command and partner by behaviour, and the impedance."""
    behaviours = summary[summary["kind"] == "compliance"]
    pulls = summary[summary["kind"] == "impedance"]
    figure = Figure(figsize=FIGURE_SIZE, layout="constrained")
    panels = list(figure.subplots(2, 2).flat)
    for axes, column, title in zip(
        panels,
        ("handle_force_p95", "hand_force_p95", "E_v_partner"),
        (
            "horizontal force at the handle, p95 [N]",
            "horizontal force at a hand, p95 [N]",
            "handle against partner [m/s]",
        ),
        strict=False,
    ):
        _behaviour_bars(axes, behaviours, column)
        axes.set_title(title)
    _impedance_curves(panels[3], pulls, variants_of(summary))
    letter(panels)
    legend(figure, panels[0] if len(behaviours) else panels[3])
    figure.suptitle(
        "forces: means over all trials, whiskers: peaks; (c), (d): over surviving trials, × none", fontsize=9
    )
    return figure


def _behaviour_bars(axes: Axes, chosen: pd.DataFrame, column: str) -> None:
    """A bar for each case with such a figure, or a cross where nobody survived; whiskers up to the peak of a force."""
    names = [
        (suite, case, mass)
        for (suite, case, mass), group in chosen.groupby(["suite", "case", "mass"], sort=False)
        if group["handle_force_p95" if column == "E_v_partner" else column].notna().any()
    ]
    groups = {}
    for variant in variants_of(chosen):
        rows = chosen[chosen["variant"] == variant].set_index(["suite", "case", "mass"]).reindex(names)
        heights = rows[column].to_numpy(np.float64)
        failed = np.isnan(heights) & (rows["survived"].to_numpy(np.float64) == 0)
        heights = np.where(failed, 0.0, heights)
        intervals = None
        if column.endswith("_p95"):
            above = rows[column.replace("_p95", "_peak")].to_numpy(np.float64) - heights
            intervals = np.stack([np.zeros(len(names)), np.nan_to_num(above).clip(0.0)])
        groups[variant] = Bars(heights, ["×" if none else "" for none in failed], intervals)
    draw_bars(axes, groups, [f"{broken(case)}\n{mass:g} kg" for _, case, mass in names])


def _impedance_curves(axes: Axes, pulls: pd.DataFrame, variants: list[str]) -> None:
    """Magnitude over frequency, a curve for each variant and direction."""
    axes.set_title("mechanical impedance [N·s/m]")
    for (variant, direction), rows in pulls.groupby(["variant", "pull_direction"], sort=False):
        ordered = rows.sort_values("pull_frequency")
        size = np.hypot(ordered["impedance_real"], ordered["impedance_imag"])
        colour, marker = style_of(str(variant), variants)
        style = "-" if direction == "forward" else "--"
        axes.plot(
            ordered["pull_frequency"],
            size,
            color=colour,
            marker=marker,
            linestyle=style,
            label=f"{variant}, {direction}",
        )
    axes.set_xlabel("frequency of the pull [Hz]")
    tidy(axes)
    if len(pulls):
        frequencies = sorted(pulls["pull_frequency"].unique())
        axes.set_xscale("log")
        axes.set_xticks(frequencies, [f"{frequency:g}" for frequency in frequencies])
        axes.set_xticks([], minor=True)
        axes.legend(fontsize=8, frameon=False)


def _interaction(row: pd.Series) -> list[str]:
    forces = [[float(row[f"{name}_{part}"]) for part in SPREAD] for name in ("handle_force", "hand_force")]
    spreads = [ABSENT if np.isnan(sizes).any() else " / ".join(f"{size:.0f}" for size in sizes) for sizes in forces]
    work = float(row["partner_work"])
    errors = [float(row[name]) for name in ("E_v", "E_v_raw", "E_v_partner")]
    return [
        _survived(row),
        f"{row['succeeded']}/{row['trials']}",
        *spreads,
        ABSENT if np.isnan(work) else f"{work:+.1f}",
        *(FAILS if not row["survived"] else ABSENT if np.isnan(value) else f"{value:.3f}" for value in errors),
    ]


def _survived(row: pd.Series) -> str:
    return f"{row['survived']}/{row['trials']}"


def _impedance(row: pd.Series) -> complex:
    return complex(row["impedance_real"], row["impedance_imag"])


def _polar(value: complex) -> list[str]:
    """Size and phase of a mean impedance; what it says of spring, damper and mass takes several frequencies."""
    if np.isnan(value):
        return [FAILS, FAILS, *[ABSENT] * 3]
    return [f"{abs(value):.0f}", f"{np.degrees(np.angle(value)):+.0f}", *[ABSENT] * 3]
