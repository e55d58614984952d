"""Tracking error tables in the form of the paper's II and III, with its numbers and a robot that stands still."""

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import TABLES, VARIANTS, reported
from iowbc.evaluation.report import columns
from iowbc.evaluation.report.aggregate import stepping_commanded, suites_of
from iowbc.evaluation.report.captions import conditions, in_common, measures, regime
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.results.table import ABSENT, FAILS, Cell, Column, Table, measured

NUMBERS = {"lifting": "II", "pushing": "III"}
"""The paper's table number of each kind."""
SWEPT = (*NUMBERS, "squeezing")
"""Kinds of mass sweeps; the paper has no table of the last."""


def error_table(summary: pd.DataFrame, suite: str, name: str | None = None) -> Table:
    """Errors over the whole trial by mass or case and variant, with survival, success, transport and kept objects; the
    paper's columns if it has one of the variants. name: of the table, default that of the suite."""
    chosen = summary[summary["suite"] == suite]
    kind = str(chosen["kind"].iloc[0])
    beside = in_paper(chosen)
    entries = [*map(columns.error_entry, columns.ERROR_HEADS), *columns.OUTCOME]
    entries += [_paper_entry(summary, error) for error in ERRORS] if beside else []
    rows = with_paper(chosen) if beside else chosen
    return _by_mass_or_case(name or slug(suite), _caption(chosen, kind, beside), entries, rows)


def moving_table(summary: pd.DataFrame, suite: str) -> Table:
    """Errors over the parts of the trials in which stepping is commanded."""
    chosen = summary[summary["suite"] == suite]
    caption = (
        f"Command tracking errors in {suite} while a velocity is commanded: means over surviving trials with their "
        f"95 % interval. {conditions(chosen)} {measures(chosen)}"
    )
    entries = [columns.error_entry(name, "_moving") for name in columns.ERROR_HEADS]
    return _by_mass_or_case(f"{slug(suite)}_moving", caption, entries, chosen)


def paper_table(summary: pd.DataFrame) -> Table | None:
    """Cells of the paper's tables that were evaluated with walking: ours, the paper's and the ratio; None without."""
    entries = (
        columns.Entry("Mass", lambda row: f"{row['mass']:g} kg", lambda rows: "any"),
        columns.SURVIVED,
        *(_ratio_entry(summary, name) for name in columns.ERROR_HEADS),
    )
    rows: list[tuple[Cell, ...]] = []
    numbers: list[dict[str, object]] = []
    for suite in suites_of(summary, *NUMBERS):
        chosen = with_paper(summary[summary["suite"] == suite])
        if not stepping_commanded(chosen):
            continue
        kind, name = chosen["kind"].iloc[0], f"{NUMBERS[chosen['kind'].iloc[0]]}, {suite}"
        known = chosen[chosen["name_in_paper"].isin(VARIANTS)]
        of_paper = known[known["mass"].isin(TABLES[kind])]
        of_paper = pd.concat([own for _, own in of_paper.groupby("variant", sort=False)] or [of_paper])
        found = columns.variant_rows(entries, [(name, of_paper)])
        rows += [*found, columns.still_row(entries, chosen, name)] if found else []
        numbers += [
            {"suite": suite, "variant": row["variant"], "mass": row["mass"], "error": error, "ours": row[error]}
            | {"paper": row[f"paper_{error}"], "ratio": row[f"ratio_{error}"]}
            for _, row in of_paper.iterrows()
            for error in ERRORS
        ]
    if not rows:
        return None
    frame = pd.DataFrame(numbers)
    counted = [
        f"{variant} in {suite} {(own['ours'] <= own['paper']).sum()} of {len(own)}"
        for (suite, variant), own in frame[frame["paper"].notna()].groupby(["suite", "variant"], sort=False)
    ]
    caption = (
        "Tables II and III cell by cell: our mean over surviving trials / the paper's value for its own commands = "
        f"ratio. {FAILS}: no trial survived. Cells of the paper in which ours is at most as large: "
        f"{', '.join(counted)}. {columns.IDLE} {in_common(summary)}"
    )
    return columns.variant_table("paper", caption, "Table", entries, rows, frame)


def slug(suite: str) -> str:
    return suite.replace(" ", "_")


def in_paper(rows: pd.DataFrame) -> bool:
    """True if the paper has numbers for a variant in this suite's kind of trials, and ours walk as the paper's do."""
    known = bool(rows["name_in_paper"].isin(VARIANTS).any())
    return known and rows["kind"].iloc[0] in NUMBERS and stepping_commanded(rows)


def with_paper(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows with the paper's errors, `paper_<error>`, and the ratio of ours to them, `ratio_<error>`; NaN if missing."""
    found = [reported(row["kind"], row["mass"], row["name_in_paper"]) for _, row in rows.iterrows()]
    paper = np.array([[np.nan] * len(ERRORS) if one is None or one == "absent" else one for one in found], np.float64)
    columns = {f"paper_{name}": paper[:, place] for place, name in enumerate(ERRORS)}
    ratios = {f"ratio_{name}": rows[name].to_numpy(np.float64) / columns[f"paper_{name}"] for name in ERRORS}
    return rows.assign(**columns, **ratios)


def _by_mass_or_case(name: str, caption: str, entries: list[columns.Entry], chosen: pd.DataFrame) -> Table:
    """A table of a suite: by mass with one row of standing still, or by case with one in each."""
    if str(chosen["kind"].iloc[0]) not in SWEPT:
        rows = columns.variant_rows(entries, columns.by_case(chosen), still=True)
        return columns.variant_table(name, caption, "Case", entries, rows, chosen)
    groups = [
        (f"{mass:g} kg" if case in set(chosen["suite"]) else str(case), group)
        for (case, mass), group in chosen.groupby(["case", "mass"], sort=False)
    ]
    rows = [*columns.variant_rows(entries, groups), columns.still_row(entries, chosen)]
    return columns.variant_table(name, caption, "Mass", entries, rows, chosen)


def _paper_entry(summary: pd.DataFrame, error: str) -> columns.Entry:
    """The paper's error, in brackets the ratio of ours to it and the notes of `regime`."""

    def cell(row: pd.Series) -> str:
        value, ratio = row[f"paper_{error}"], row[f"ratio_{error}"]
        if np.isnan(value):
            failed = reported(row["kind"], row["mass"], row["name_in_paper"]) is None
            return FAILS if failed else ABSENT
        said = ([] if np.isnan(ratio) else [f"{ratio:.2f}"]) + regime(summary, row, error)
        return f"{value:.3f} ({'; '.join(said)})" if said else f"{value:.3f}"

    head = columns.ERROR_HEADS[error]
    return columns.Entry(Column(f"paper {head.name}", latex=f"paper {head.latex}", role="paper"), cell)


def _ratio_entry(summary: pd.DataFrame, error: str) -> columns.Entry:
    """Our error, the paper's and the ratio; ours alone if the paper does not report the error."""

    def cell(row: pd.Series) -> Cell:
        if error == columns.RAW:
            return measured(row[error], none=FAILS)
        ours, theirs = (measured(row[name], none=FAILS) for name in (error, f"paper_{error}"))
        beside = regime(summary, row, error) if np.isfinite(row[f"paper_{error}"]) else []
        ratio = measured(row[f"ratio_{error}"], form=".2f")
        return f"{ours} / {theirs} = {ratio}" + (f" ({'; '.join(beside)})" if beside else "")

    return columns.Entry(columns.ERROR_HEADS[error], cell, lambda rows: columns.still_error(rows, error))


def _caption(chosen: pd.DataFrame, kind: str, with_paper: bool) -> str:
    shares = set(chosen["partner_share"])
    whom = f"{kind} alone" if shares == {0.0} else f"cooperative {kind}" if min(shares) > 0 else kind
    like = f" (paper's Table {NUMBERS[kind]})" if kind in NUMBERS and stepping_commanded(chosen) else ""
    title = f"{whom}{like}" if kind in SWEPT else f"the suite {kind}"
    failed = f" {FAILS}: no trial survived." if (chosen["survived"] == 0).any() else ""
    aim = " The crate cannot move; success: survived in the commanded posture, with feet in place and a sustained push."
    beside = " Right: the paper's values, for its own commands, and in brackets ours divided by them."
    return (
        f"Command tracking errors under {title}: means over surviving trials with their 95 % interval. "
        f"{conditions(chosen)} {measures(chosen)} Transport, over all trials: fractions of the commanded distance that "
        "robot / object cover; kept: fraction of the robot's part of the weight that its hands bear, or trials whose "
        f"crate is not lost to a side; success: survived, with enough of both. {columns.IDLE}"
        f"{failed}{aim if kind == 'stagnation' else ''}{beside if with_paper else ''}"
    )
