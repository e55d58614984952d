"""Success in the heavy tasks, load capacity, pushes survived, and the joints at their limits."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import TYRE_SUCCESS
from iowbc.evaluation.report.aggregate import GROUP, TORQUE, suites_of, variants_of
from iowbc.evaluation.report.capacity import Capacity, load_capacity, push_capacity
from iowbc.evaluation.report.captions import conditions
from iowbc.evaluation.report.error_tables import NO_LABELS, STANDS_STILL, SWEPT
from iowbc.evaluation.report.tables import ABSENT, Table

TYRE_MASS = 18.0
PROBING = ("pushes", "impedance", "map")
"""Kinds of trials that look for a limit or a response, not for how a task is done."""
CONTACT = {
    "Touchdown [m/s]": ("touchdown_speed", 1.0, 2),
    "Peak force [N]": ("foot_force_peak", 1.0, 0),
    "Pressure margin [mm]": ("pressure_margin", 1e3, 0),
    "Friction": ("friction_use_high", 1.0, 2),
    "Action [mrad]": ("action_second_difference", 1e3, 0),
}
"""Columns of the table of contact: name in the summary, factor, decimals."""
CONTACT_COLUMNS = [
    *("touchdown_speed", "touchdown_speed_peak", "foot_force_peak", "pressure_margin", "pressure_margin_low"),
    *("friction_use", "friction_use_high", "action_second_difference"),
]
JOINTS_SHOWN = 5
"""Joints in the table of torques, those most often at their limit first; the CSV has all."""


def success_table(summary: pd.DataFrame, labels: Mapping[str, str] = NO_LABELS) -> Table:
    """The heavy tasks: how many trials succeeded, with Wilson's interval, beside the paper's rate."""
    chosen = summary[summary["suite"] == "heavy"]
    rows = []
    for (case, mass), group in chosen.groupby(["case", "mass"], sort=False):
        for _, row in group.iterrows():
            variant = str(row["variant"])
            paper = TYRE_SUCCESS.get(labels.get(variant, variant)) if mass == TYRE_MASS else None
            rows.append(
                (
                    f"{case} ({mass:g} kg)",
                    variant,
                    f"{row['survived']}/{row['trials']}",
                    f"{row['succeeded']}/{row['trials']}",
                    f"{100 * row['rate']:.0f} %",
                    f"{100 * row['rate_low']:.0f} to {100 * row['rate_high']:.0f} %",
                    ABSENT if paper is None else f"{100 * paper:.0f} %",
                )
            )
        if (group["commanded_distance"] > 0).any():
            rows.append((f"{case} ({mass:g} kg)", STANDS_STILL, ABSENT, "none", "0 %", ABSENT, ABSENT))
    head = ("Task", "Algorithm", "Survived", "Success", "Rate", "95 % interval", "Paper")
    caption = f"Success in the heavy tasks. {conditions(chosen)}"
    return Table("heavy", caption, head, head, tuple(rows), chosen)


def capacity_table(summary: pd.DataFrame, rate: float) -> Table:
    """The largest mass that each variant carries and pushes with the success rate asked for."""
    suites = suites_of(summary, *SWEPT)
    found = {
        variant: [load_capacity(summary, suite, variant, rate) for suite in suites] for variant in variants_of(summary)
    }
    still = ["none" if (summary.loc[summary["suite"] == s, "commanded_distance"] > 0).any() else ABSENT for s in suites]
    rows = [(variant, *(_cell(one, "kg") for one in row)) for variant, row in found.items()]
    head = ("Variant", *(suite.capitalize() for suite in suites))
    caption = (
        f"Load capacity: the largest mass up to which every mass reached {100 * rate:.0f} % success; "
        "≥ where the heaviest tried did. In simulation."
    )
    return Table("capacity", caption, head, head, (*rows, (STANDS_STILL, *still)), _numbers(found, suites))


def push_table(summary: pd.DataFrame, rate: float) -> Table:
    """The largest impulse on the base that each variant survives, by direction."""
    pushes = summary[summary["kind"] == "pushes"]
    directions = list(dict.fromkeys(pushes["case"]))
    found = {v: [push_capacity(summary, d, v, rate) for d in directions] for v in variants_of(pushes)}
    rows = [(variant, *(_cell(one, "N·s") for one in row)) for variant, row in found.items()]
    head = ("Variant", *directions)
    caption = (
        f"Impulse on the base survived while standing with {float(pushes['mass'].iloc[0]):g} kg, by its direction: the "
        f"largest up to which every one tried reached {100 * rate:.0f} % survival. In simulation, without a partner."
    )
    return Table("pushes", caption, head, head, tuple(rows), _numbers(found, directions))


def joint_table(summary: pd.DataFrame) -> Table:
    """Peak torque of the joints and how long they are at their limit, at the heaviest mass of each suite survived."""
    joints = [name.removeprefix("saturated/") for name in summary.columns if name.startswith("saturated/")]
    rows, numbers = [], []
    for _, row in heaviest(summary).iterrows():
        by_joint = [(float(row[f"saturated/{joint}"]), float(row[f"peak_torque/{joint}"]), joint) for joint in joints]
        load = _load(row)
        keys = {name: row[name] for name in ("variant", "suite", "case", "mass")}
        numbers += [{**keys, "joint": j, "saturated": s, "peak_torque": t} for s, t, j in by_joint]
        worst = sorted(by_joint, key=lambda entry: (-entry[0], entry[2]))[:JOINTS_SHOWN]
        rows += [(load, str(row["variant"]), j, f"{t:.1f}", f"{100 * s:.1f} %") for s, t, j in worst]
    head = ("Load", "Algorithm", "Joint", "Peak torque [N·m]", "At its limit")
    caption = (
        "The joints most often at their torque limit at the heaviest load survived: mean over surviving trials of the "
        "peak torque, and the share of the time at the limit. In simulation."
    )
    return Table("joints", caption, head, head, tuple(rows), pd.DataFrame(numbers))


def contact_table(summary: pd.DataFrame) -> Table:
    """How gently each variant meets the ground, how near it is to tipping and slipping, how smooth and how strenuous
    its action is, at the heaviest mass of each suite survived."""
    rows = [
        (
            _load(row),
            str(row["variant"]),
            *(_told(row[name], scale, places) for name, scale, places in CONTACT.values()),
            f"{100 * row[TORQUE]:.0f} % ({row[f'{TORQUE}_joint']})" if np.isfinite(row[TORQUE]) else ABSENT,
        )
        for _, row in heaviest(summary).iterrows()
    ]
    head = ("Load", "Algorithm", *CONTACT, "Torque, worst joint")
    caption = (
        "Contact with the ground and effort at the heaviest load survived: means over surviving trials. Touchdown: "
        "speed of the lowest corner of a sole before it touches. Peak force: of the ground on a foot, in any physics "
        "step. Pressure margin: distance of a loaded foot's centre of pressure from the edge of its sole, mean by its "
        "load. Friction: horizontal force as a part of what friction allows, 95th percentile. Action: root mean "
        "square of its second difference over a control period. Torque: root mean square as a part of the limit, of "
        "the joint with the most. In simulation."
    )
    return Table("contact", caption, head, head, tuple(rows), summary[[*GROUP, *CONTACT_COLUMNS, *_efforts(summary)]])


def heaviest(summary: pd.DataFrame) -> pd.DataFrame:
    """The row of the heaviest mass that each variant survived in each suite of tasks."""
    survived = summary[(summary["survived"] > 0) & ~summary["kind"].isin(PROBING)]
    rows: pd.DataFrame = survived.sort_values("mass").groupby(["suite", "variant"], sort=False).tail(1)
    return rows.sort_index()


def _load(row: pd.Series) -> str:
    case = "" if row["case"] == row["suite"] else f", {row['case']}"
    return f"{row['suite']}{case}, {row['mass']:g} kg"


def _told(value: float, scale: float, places: int) -> str:
    return ABSENT if np.isnan(value) else f"{scale * value:.{places}f}"


def _efforts(summary: pd.DataFrame) -> list[str]:
    return [name for name in summary.columns if name.startswith(TORQUE)]


def _cell(found: Capacity | None, unit: str) -> str:
    return ABSENT if found is None else found.text(unit)


def _numbers(found: Mapping[str, list[Capacity | None]], names: list[str]) -> pd.DataFrame:
    records = [
        {"variant": variant, "of": name, "value": np.nan if one.value is None else one.value, "open": one.open_ended}
        for variant, row in found.items()
        for name, one in zip(names, row, strict=True)
        if one is not None
    ]
    return pd.DataFrame(records, columns=["variant", "of", "value", "open"])
