"""Success in the heavy tasks, load capacity, pushes survived, and the joints at their limits."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import TYRE_SUCCESS
from iowbc.evaluation.report.aggregate import suites_of, variants_of
from iowbc.evaluation.report.capacity import Capacity, load_capacity, push_capacity
from iowbc.evaluation.report.captions import conditions
from iowbc.evaluation.report.error_tables import NO_LABELS, STANDS_STILL, SWEPT
from iowbc.evaluation.report.tables import ABSENT, Table

TYRE_MASS = 18.0
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
    survived = summary[(summary["survived"] > 0) & (summary["kind"] != "pushes")]
    heaviest = survived.sort_values("mass").groupby(["suite", "variant"], sort=False).tail(1)
    for _, row in heaviest.sort_index().iterrows():
        by_joint = [(float(row[f"saturated/{joint}"]), float(row[f"peak_torque/{joint}"]), joint) for joint in joints]
        load = (
            f"{row['suite']}, {row['case']}, {row['mass']:g} kg"
            if row["case"] != row["suite"]
            else (f"{row['suite']}, {row['mass']:g} kg")
        )
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
