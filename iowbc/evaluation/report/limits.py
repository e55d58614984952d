"""Tables of limits: capacity, survived pushes, success in the heavy tasks, joint torques, contact with the ground."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import TYRE_SUCCESS
from iowbc.evaluation.report import columns
from iowbc.evaluation.report.aggregate import TORQUE, suites_of, variants_of
from iowbc.evaluation.report.captions import conditions
from iowbc.evaluation.report.error_tables import SWEPT
from iowbc.results.table import ABSENT, Cell, Table, heads

TYRE_MASS = 18.0
PROBING = ("pushes", "impedance", "map")
"""Kinds of trials that measure a limit or a response rather than task performance."""
JOINTS_SHOWN = 5
"""Number of joints in the torque table, those most often at their limit first; the CSV file has all."""


@dataclass(frozen=True)
class Capacity:
    """The largest value up to which all tested values reached the success rate."""

    value: float | None
    """None if the smallest tested value failed."""
    smallest: float
    open_ended: bool
    """True if `value` is the largest tested value, so that the capacity may be larger."""

    def text(self, unit: str) -> str:
        if self.value is None:
            return f"< {self.smallest:g} {unit}" if self.smallest > 0 else "Fails"
        return f"{'≥ ' if self.open_ended else ''}{self.value:g} {unit}"


Capacities = dict[str, dict[str, Capacity]]
"""Capacities by variant, then by suite or direction, of those that were tested."""


def load_capacities(summary: pd.DataFrame, rate: float) -> Capacities:
    """Load capacity [kg] of each variant in each mass sweep at a success rate."""
    swept = summary[summary["kind"].isin(SWEPT) & (summary["case"] == summary["suite"])]
    return {variant: {} for variant in variants_of(summary)} | _capacities(swept, "mass", rate)


def push_capacities(summary: pd.DataFrame, rate: float) -> Capacities:
    """Largest impulse on the base [N·s] in each direction up to which all reached the success rate."""
    pushed = summary[summary["kind"] == "pushes"]
    return {variant: {} for variant in variants_of(summary)} | _capacities(pushed, "impulse", rate)


def _capacities(rows: pd.DataFrame, by: str, rate: float) -> Capacities:
    found: Capacities = {variant: {} for variant in variants_of(rows)}
    for (variant, case), own in rows.groupby(["variant", "case"], sort=False):
        ordered = own.sort_values(by)
        passed = (ordered["rate"] >= rate).cummin()
        values = ordered.loc[passed, by]
        value = float(values.iloc[-1]) if len(values) else None
        found[variant][case] = Capacity(value, float(ordered[by].iloc[0]), bool(passed.all()))
    return found


def capacity_table(summary: pd.DataFrame, rate: float) -> Table:
    suites = suites_of(summary, *SWEPT)
    asked = [(summary.loc[summary["suite"] == suite, "commanded_distance"] > 0).any() for suite in suites]
    caption = (
        f"Load capacity: the largest mass up to which every mass has at least {100 * rate:.0f} % success; "
        "≥: so has the heaviest mass played. In simulation."
    )
    still = (columns.STANDS_STILL, *("none" if one else ABSENT for one in asked))
    names = {suite: suite.capitalize() for suite in suites}
    return _capacity_table("capacity", caption, load_capacities(summary, rate), names, "kg", [still])


def masses_of(rows: pd.DataFrame) -> str:
    """The masses of some rows in words; standing and walking may differ."""
    return " or ".join(f"{mass:g} kg" for mass in sorted(set(rows["mass"])))


def push_table(summary: pd.DataFrame, rate: float) -> Table:
    """The largest impulse on the base that each variant survives, by direction."""
    pushes = summary[summary["kind"] == "pushes"]
    caption = (
        f"Largest impulse on the base, by direction, standing or walking with {masses_of(pushes)} in "
        f"the hands, up to which the robot survives every impulse played, and walks on, in at least {100 * rate:.0f} % "
        "of the trials. In simulation, without a partner."
    )
    directions = {str(case): str(case) for case in dict.fromkeys(pushes["case"])}
    return _capacity_table("pushes", caption, push_capacities(summary, rate), directions, "N·s", [])


def _capacity_table(
    name: str, caption: str, found: Capacities, names: dict[str, str], unit: str, last: list[tuple[str, ...]]
) -> Table:
    """Table with a row per variant; `names`: heads by suite or direction."""
    rows, numbers = [], []
    for variant, own in found.items():
        rows.append((variant, *(own[case].text(unit) if case in own else ABSENT for case in names)))
        numbers += [(variant, case, own[case].value, own[case].open_ended) for case in names if case in own]
    frame = pd.DataFrame(numbers, columns=["variant", "of", "value", "open"])
    return Table(name, caption, heads("Variant", *names.values()), [*rows, *last], frame, grouped=False)


def success_table(summary: pd.DataFrame) -> Table:
    """Successful trials in the heavy tasks, with Wilson interval and the paper's rate."""

    def paper(row: pd.Series) -> str:
        rate = TYRE_SUCCESS.get(row["name_in_paper"]) if row["mass"] == TYRE_MASS else None
        return ABSENT if rate is None else f"{100 * rate:.0f} %"

    entries = (
        columns.SURVIVED,
        columns.Entry("Success", lambda row: f"{row['succeeded']}/{row['trials']}", lambda rows: "none"),
        columns.Entry("Rate", lambda row: f"{100 * row['rate']:.0f} %", lambda rows: "0 %"),
        columns.Entry("95 % interval", lambda row: f"{100 * row['rate_low']:.0f} to {100 * row['rate_high']:.0f} %"),
        columns.Entry("Paper", paper),
    )
    chosen = summary[summary["suite"] == "heavy"]
    rows: list[tuple[Cell, ...]] = []
    for name, group in columns.by_case(chosen):
        rows += columns.variant_rows(entries, [(name, group)], still=bool((group["commanded_distance"] > 0).any()))
    caption = f"Success in the heavy tasks. {conditions(chosen)}"
    return columns.variant_table("heavy", caption, "Task", entries, rows, chosen)


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
    columns.mean_entry("Touchdown [m/s]", "touchdown_speed", ".2f"),
    columns.mean_entry("Peak force [N]", "foot_force_peak", ".0f"),
    columns.mean_entry("Pressure margin [mm]", "pressure_margin", ".0f", 1e3),
    columns.mean_entry("Friction", "friction_use_high", ".2f"),
    columns.mean_entry("Action [mrad]", "action_second_difference", ".0f", 1e3),
    columns.Entry(
        "Torque, worst joint",
        lambda row: f"{100 * row[TORQUE]:.0f} % ({row[f'{TORQUE}_joint']})" if np.isfinite(row[TORQUE]) else ABSENT,
    ),
)


def contact_table(summary: pd.DataFrame) -> Table:
    """Foot impacts, margins to tipping and slipping, smoothness and effort at the heaviest mass survived by suite."""
    chosen = heaviest(summary)
    rows = columns.variant_rows(CONTACT, [(_load(row), row.to_frame().T) for _, row in chosen.iterrows()])
    caption = (
        "Contact with the ground and effort at the heaviest load survived: means over surviving trials. Touchdown: "
        "speed of the lowest corner of a sole before it touches. Peak force: of the ground on a foot, in any physics "
        "step. Pressure margin: distance of a loaded foot's centre of pressure from the edge of its sole, mean by its "
        "load. Friction: horizontal force as a fraction of the largest that friction allows, 95th percentile. "
        "Action: root mean square of its second difference over a control period. Torque: root mean square as a "
        "fraction of the limit, of the joint with the largest. In simulation."
    )
    return columns.variant_table("contact", caption, "Load", CONTACT, rows, chosen)


def heaviest(summary: pd.DataFrame) -> pd.DataFrame:
    """Rows of the heaviest mass, the last of several, that a variant survived in a suite, without `PROBING` trials."""
    survived = summary[(summary["survived"] > 0) & ~summary["kind"].isin(PROBING)]
    rows: pd.DataFrame = survived.sort_values("mass", kind="stable").groupby(["suite", "variant"], sort=False).tail(1)
    return rows.sort_index()


def _load(row: pd.Series) -> str:
    case = "" if row["case"] == row["suite"] else f", {row['case']}"
    return f"{row['suite']}{case}, {row['mass']:g} kg"
