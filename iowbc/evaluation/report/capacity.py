"""Capacity: the largest load or push up to which a variant succeeds."""

from dataclasses import dataclass

import pandas as pd

from iowbc.evaluation.report.aggregate import suites_of, variants_of
from iowbc.evaluation.report.columns import STANDS_STILL
from iowbc.evaluation.report.error_tables import SWEPT
from iowbc.results.table import ABSENT, Table, heads


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
    return _capacities(summary[summary["kind"] == "pushes"], "impulse", rate)


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
    still = (STANDS_STILL, *("none" if one else ABSENT for one in asked))
    columns = {suite: suite.capitalize() for suite in suites}
    return _table("capacity", caption, load_capacities(summary, rate), columns, "kg", [still])


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
    return _table("pushes", caption, push_capacities(summary, rate), directions, "N·s", [])


def _table(
    name: str, caption: str, found: Capacities, columns: dict[str, str], unit: str, last: list[tuple[str, ...]]
) -> Table:
    """Table with a row per variant; `columns`: heads by suite or direction."""
    rows, numbers = [], []
    for variant, own in found.items():
        rows.append((variant, *(own[case].text(unit) if case in own else ABSENT for case in columns)))
        numbers += [(variant, case, own[case].value, own[case].open_ended) for case in columns if case in own]
    frame = pd.DataFrame(numbers, columns=["variant", "of", "value", "open"])
    return Table(name, caption, heads("Variant", *columns.values()), [*rows, *last], frame, grouped=False)
