"""How much a variant withstands: the largest load, or push, up to which it succeeds."""

from dataclasses import dataclass

import pandas as pd


@dataclass(frozen=True)
class Capacity:
    """The largest value up to which every value tried reached the success rate."""

    value: float | None
    """None where the smallest one failed."""
    smallest: float
    """That was tried."""
    open_ended: bool
    """Whether it is also the largest that was tried, so that the true one may be larger."""

    def text(self, unit: str) -> str:
        """As it stands in a table."""
        if self.value is None:
            return f"< {self.smallest:g} {unit}" if self.smallest > 0 else "Fails"
        return f"{'≥ ' if self.open_ended else ''}{self.value:g} {unit}"


def capacity(rows: pd.DataFrame, by: str, rate: float) -> Capacity | None:
    """The capacity in rows of a summary along a column, "mass" or "impulse"; None where there are no rows."""
    if rows.empty:
        return None
    ordered = rows.sort_values(by)
    passed = (ordered["rate"] >= rate).cummin()
    values = ordered.loc[passed, by]
    value = float(values.iloc[-1]) if len(values) else None
    return Capacity(value, float(ordered[by].iloc[0]), bool(passed.all()))


def load_capacity(summary: pd.DataFrame, suite: str, variant: str, rate: float) -> Capacity | None:
    """The largest mass of a sweep [kg] up to which every mass of an object reached the success rate; None if it was not
    played."""
    loaded = (summary["suite"] == suite) & (summary["variant"] == variant) & (summary["case"] == suite)
    return capacity(summary[loaded], "mass", rate)


def push_capacity(summary: pd.DataFrame, direction: str, variant: str, rate: float) -> Capacity | None:
    """The largest impulse on the base in a direction [N·s] up to which every one was survived at the rate, or None."""
    chosen = (summary["kind"] == "pushes") & (summary["case"] == direction) & (summary["variant"] == variant)
    return capacity(summary[chosen], "impulse", rate)
