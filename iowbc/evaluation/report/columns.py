"""Columns of result tables: head, cell for a row of the summary, score of a robot that stands still."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from iowbc.evaluation.trials.errors import ERRORS, SHORTEST_WAY
from iowbc.results.table import ABSENT, FAILS, Cell, Column, Table, heads, measured

STANDS_STILL = "stands still"
"""Baseline row: scores of a robot that does not move, computed from the script."""
IDLE = f"{STANDS_STILL}: errors of a robot that does nothing, computed from the script."
"""Sentence of a caption about such rows."""
RAW = "E_v_raw"
"""E_v without the mean over a gait period."""
ERROR_HEADS = {
    "E_alpha": Column("E_α", "rad", r"$E_{\alpha}$"),
    "E_h": Column("E_h", "m", "$E_{h}$"),
    "E_v": Column("E_v", "m/s", "$E_{v}$"),
    RAW: Column("E_v raw", "m/s", "$E_{v}$ raw", "detail"),
    "E_psi": Column("E_ψ", "rad", r"$E_{\psi}$"),
}
HEADS = {name: ERROR_HEADS[name] for name in ERRORS}
"""Heads of the paper's four errors."""


@dataclass(frozen=True)
class Entry:
    """One column of a table with a row per variant."""

    head: str | Column
    cell: Callable[[pd.Series], Cell]
    still: Callable[[pd.DataFrame], Cell] = lambda rows: ABSENT
    """Cell of a robot that stands still, from the rows of all variants."""


def variant_rows(
    entries: Sequence[Entry], groups: Iterable[tuple[str, pd.DataFrame]], still: bool = False
) -> list[tuple[Cell, ...]]:
    """Rows of a table: name of the group, variant, entries; `still` adds a row of standing still to each group."""
    found: list[tuple[Cell, ...]] = []
    for name, group in groups:
        found += [(name, str(row["variant"]), *(one.cell(row) for one in entries)) for _, row in group.iterrows()]
        found += [still_row(entries, group, name)] if still else []
    return found


def variant_table(
    name: str, caption: str, first: str, entries: Sequence[Entry], rows: list[tuple[Cell, ...]], numbers: pd.DataFrame
) -> Table:
    """Table of the rows of `variant_rows`; `first`: head of the column of group names."""
    return Table(name, caption, heads(first, "Algorithm", *(one.head for one in entries)), rows, numbers)


def still_row(entries: Sequence[Entry], rows: pd.DataFrame, name: str = "any") -> tuple[Cell, ...]:
    return (name, STANDS_STILL, *(one.still(rows) for one in entries))


def by_case(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Rows grouped by case and mass, with the name of each group."""
    groups = rows.groupby(["suite", "case", "mass"], sort=False)
    return [(f"{case} ({mass:g} kg)", group) for (_, case, mass), group in groups]


def still_error(rows: pd.DataFrame, name: str, part: str = "") -> Cell:
    """Mean error of a robot that stands still; E_v raw equals E_v, since its velocity needs no averaging."""
    return measured(float(rows[f"still_{'E_v' if name == RAW else name}{part}"].mean()))


def error_entry(name: str, part: str = "") -> Entry:
    """Mean of an error with its interval; `part`: suffix of a part of the trial."""

    def cell(row: pd.Series) -> Cell:
        half = row.get(f"{name}{part}_half", np.nan)
        return measured(row[f"{name}{part}"], half) if row["survived"] else FAILS

    return Entry(ERROR_HEADS[name], cell, lambda rows: still_error(rows, name, part))


def mean_entry(head: str, name: str, form: str, scale: float = 1.0) -> Entry:
    """Mean of a metric, times a factor; absent in trials of an earlier version without it."""
    return Entry(head, lambda row: measured(scale * row.get(name, np.nan), form=form))


def transport_commanded(rows: pd.DataFrame) -> bool:
    """True if any of these trials commands a distance that must be covered."""
    return bool((rows["commanded_distance"] >= SHORTEST_WAY).any()) and not (rows["kind"] == "stagnation").all()


def _transport(row: pd.Series) -> str:
    ways = (float(row["transport_robot"]), float(row["transport_object"]))
    return " / ".join(f"{way:.2f}" for way in ways if not np.isnan(way)) or ABSENT


def _kept(row: pd.Series) -> str:
    share = float(row["weight_in_hands"])
    return f"{row['kept']}/{row['pushed']}" if row["pushed"] else ABSENT if np.isnan(share) else f"{100 * share:.0f} %"


SURVIVED = Entry("Survived", lambda row: f"{row['survived']}/{row['trials']}")
SUCCESS = Entry(
    "Success",
    lambda row: f"{row['succeeded']}/{row['trials']}",
    lambda rows: "none" if transport_commanded(rows) else ABSENT,
)
OUTCOME = (
    SURVIVED,
    SUCCESS,
    Entry("Transport", _transport, lambda rows: "0.00" if transport_commanded(rows) else ABSENT),
    Entry("Kept", _kept),
)
