"""Tables of success in the heavy tasks, joint torques at their limits, and ground contact."""

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import TYRE_SUCCESS
from iowbc.evaluation.report.aggregate import TORQUE
from iowbc.evaluation.report.captions import conditions
from iowbc.evaluation.report.columns import SURVIVED, Entry, by_case, mean_entry, variant_rows, variant_table
from iowbc.results.table import ABSENT, Cell, Column, Table, heads

TYRE_MASS = 18.0
PROBING = ("pushes", "impedance", "map")
"""Kinds of trials that measure a limit or a response rather than task performance."""
JOINTS_SHOWN = 5
"""Number of joints in the torque table, those most often at their limit first; the CSV file has all."""


def success_table(summary: pd.DataFrame) -> Table:
    """Successful trials in the heavy tasks, with Wilson interval and the paper's rate."""

    def paper(row: pd.Series) -> str:
        rate = TYRE_SUCCESS.get(row["name_in_paper"]) if row["mass"] == TYRE_MASS else None
        return ABSENT if rate is None else f"{100 * rate:.0f} %"

    entries = (
        SURVIVED,
        Entry(Column("Success"), lambda row: f"{row['succeeded']}/{row['trials']}", lambda rows: "none"),
        Entry(Column("Rate"), lambda row: f"{100 * row['rate']:.0f} %", lambda rows: "0 %"),
        Entry(Column("95 % interval"), lambda row: f"{100 * row['rate_low']:.0f} to {100 * row['rate_high']:.0f} %"),
        Entry(Column("Paper"), paper),
    )
    chosen = summary[summary["suite"] == "heavy"]
    rows: list[tuple[Cell, ...]] = []
    for name, group in by_case(chosen):
        rows += variant_rows(entries, [(name, group)], still=bool((group["commanded_distance"] > 0).any()))
    caption = f"Success in the heavy tasks. {conditions(chosen)}"
    return variant_table("heavy", caption, "Task", entries, rows, chosen)


def joint_table(summary: pd.DataFrame) -> Table:
    """Peak joint torques and fraction of time at the limit, at the heaviest mass survived in each suite."""
    joints = [name.removeprefix("saturated/") for name in summary.columns if name.startswith("saturated/")]
    rows, numbers = [], []
    for _, row in heaviest(summary).iterrows():
        by_joint = [(float(row[f"saturated/{joint}"]), float(row[f"peak_torque/{joint}"]), joint) for joint in joints]
        keys = {name: row[name] for name in ("variant", "suite", "case", "mass")}
        numbers += [{**keys, "joint": j, "saturated": s, "peak_torque": t} for s, t, j in by_joint]
        worst = sorted(by_joint, key=lambda entry: (-entry[0], entry[2]))[:JOINTS_SHOWN]
        rows += [(_load(row), str(row["variant"]), j, f"{t:.1f}", f"{100 * s:.1f} %") for s, t, j in worst]
    columns = heads("Load", "Algorithm", "Joint", "Peak torque [N·m]", "At its limit")
    caption = (
        "The joints most often at their torque limit at the heaviest load survived: mean over surviving trials of the "
        "peak torque, and the fraction of the time at the limit. In simulation."
    )
    return Table("joints", caption, columns, rows, pd.DataFrame(numbers))


CONTACT = (
    mean_entry("Touchdown [m/s]", "touchdown_speed", ".2f"),
    mean_entry("Peak force [N]", "foot_force_peak", ".0f"),
    mean_entry("Pressure margin [mm]", "pressure_margin", ".0f", 1e3),
    mean_entry("Friction", "friction_use_high", ".2f"),
    mean_entry("Action [mrad]", "action_second_difference", ".0f", 1e3),
    Entry(
        Column("Torque, worst joint"),
        lambda row: f"{100 * row[TORQUE]:.0f} % ({row[f'{TORQUE}_joint']})" if np.isfinite(row[TORQUE]) else ABSENT,
    ),
)


def contact_table(summary: pd.DataFrame) -> Table:
    """Foot impacts, margins to tipping and slipping, smoothness and effort at the heaviest mass survived by suite."""
    chosen = heaviest(summary)
    rows = variant_rows(CONTACT, [(_load(row), row.to_frame().T) for _, row in chosen.iterrows()])
    caption = (
        "Contact with the ground and effort at the heaviest load survived: means over surviving trials. Touchdown: "
        "speed of the lowest corner of a sole before it touches. Peak force: of the ground on a foot, in any physics "
        "step. Pressure margin: distance of a loaded foot's centre of pressure from the edge of its sole, mean by its "
        "load. Friction: horizontal force as a fraction of the largest that friction allows, 95th percentile. "
        "Action: root mean square of its second difference over a control period. Torque: root mean square as a "
        "fraction of the limit, of the joint with the largest. In simulation."
    )
    return variant_table("contact", caption, "Load", CONTACT, rows, chosen)


def heaviest(summary: pd.DataFrame) -> pd.DataFrame:
    """Rows of the heaviest mass, the last of several, that a variant survived in a suite, without `PROBING` trials."""
    survived = summary[(summary["survived"] > 0) & ~summary["kind"].isin(PROBING)]
    rows: pd.DataFrame = survived.sort_values("mass", kind="stable").groupby(["suite", "variant"], sort=False).tail(1)
    return rows.sort_index()


def _load(row: pd.Series) -> str:
    case = "" if row["case"] == row["suite"] else f", {row['case']}"
    return f"{row['suite']}{case}, {row['mass']:g} kg"
