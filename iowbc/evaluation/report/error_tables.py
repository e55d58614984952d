"""Tables of tracking errors in the paper's own form (II and III), beside its numbers and a robot that stands still."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import TABLES, VARIANTS, reported
from iowbc.evaluation.report.aggregate import asks_for_steps, suites_of
from iowbc.evaluation.report.captions import conditions, in_common, measures, regime
from iowbc.evaluation.report.columns import (
    ERROR_HEADS,
    HEADS,
    OUTCOME,
    RAW,
    STANDS_STILL,
    SURVIVED,
    Entry,
    by_case,
    error_entry,
    still_error,
    still_row,
    variant_rows,
    variant_table,
)
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.results.table import ABSENT, FAILS, Cell, Column, Table, measured

NUMBERS = {"lifting": "II", "pushing": "III"}
"""The paper's table of a kind."""
SWEPT = (*NUMBERS, "squeezing")
"""Kinds of suites that go over masses; the paper has no table of the last."""
NO_LABELS: Mapping[str, str] = MappingProxyType({})


def error_table(
    summary: pd.DataFrame, suite: str, labels: Mapping[str, str] = NO_LABELS, name: str | None = None
) -> Table:
    """Errors over the whole trial by mass or case and variant, with survival, success, transport, what is kept.

    labels: the paper's name of variants that go by another one here; where it knows none, its columns are left out.
    name: of the table; that of the suite by default.
    """
    chosen = summary[summary["suite"] == suite]
    kind = str(chosen["kind"].iloc[0])
    known = any(labels.get(str(variant), str(variant)) in VARIANTS for variant in chosen["variant"])
    with_paper = kind in NUMBERS and known and asks_for_steps(chosen)
    entries = [*map(error_entry, ERROR_HEADS), *OUTCOME]
    entries += [_paper_entry(summary, error, labels) for error in ERRORS] if with_paper else []
    caption, numbers = _caption(chosen, kind, with_paper), _with_papers(chosen, labels) if with_paper else chosen
    return _by_mass_or_case(name or slug(suite), caption, entries, chosen, numbers)


def moving_table(summary: pd.DataFrame, suite: str) -> Table:
    """The errors over the part of the trials in which steps are asked for."""
    chosen = summary[summary["suite"] == suite]
    caption = (
        f"Command tracking errors in {suite} while steps are asked for: means over surviving trials with their "
        f"95 % interval. {conditions(chosen)} {measures(chosen)}"
    )
    entries = [error_entry(name, "_moving") for name in ERROR_HEADS]
    return _by_mass_or_case(f"{slug(suite)}_moving", caption, entries, chosen, chosen)


def paper_table(summary: pd.DataFrame, labels: Mapping[str, str] = NO_LABELS) -> Table | None:
    """Every cell of the paper's tables that was played walking: ours, the paper's, and the ratio; None without any.

    labels: the paper's name of variants that go by another one here.
    """
    entries = (
        Entry(Column("Mass"), lambda row: f"{row['mass']:g} kg", lambda rows: "any"),
        SURVIVED,
        *(_ratio_entry(summary, name, labels) for name in ERROR_HEADS),
    )
    rows: list[tuple[Cell, ...]] = []
    numbers: list[dict[str, object]] = []
    for suite in suites_of(summary, *NUMBERS):
        chosen = summary[summary["suite"] == suite]
        kind = str(chosen["kind"].iloc[0])
        known = chosen["variant"].map(lambda variant: labels.get(variant, variant)).isin(VARIANTS)
        if not asks_for_steps(chosen):
            continue
        of_paper = [
            own[own["mass"] == mass] for _, own in chosen[known].groupby("variant", sort=False) for mass in TABLES[kind]
        ]
        found = variant_rows(entries, [(f"{NUMBERS[kind]}, {suite}", own) for own in of_paper])
        rows += [*found, still_row(entries, chosen, f"{NUMBERS[kind]}, {suite}")] if found else []
        numbers += [
            {"suite": suite, "variant": row["variant"], "mass": row["mass"], "error": name, "ours": row[name]}
            | {"paper": theirs, "ratio": row[name] / theirs}
            for own in of_paper
            for _, row in own.iterrows()
            for name, theirs in zip(ERRORS, _papers(row, labels), strict=True)
        ]
    if not rows:
        return None
    frame = pd.DataFrame(numbers)
    counted = [
        f"{variant} in {suite} {(own['ours'] <= own['paper']).sum()} of {len(own)}"
        for (suite, variant), own in frame[frame["paper"].notna()].groupby(["suite", "variant"], sort=False)
    ]
    caption = (
        "Tables II and III cell by cell: ours / the paper's = ratio, means over surviving trials; the paper's are for "
        f"its own commands. {FAILS}: no trial survived. Cells with a number of the paper's in which ours is at most as "
        f"large: {', '.join(counted)}. {STANDS_STILL}: what doing nothing scores, from the script. "
        f"{in_common(summary)}"
    )
    return variant_table("paper", caption, "Table", entries, rows, frame)


def slug(suite: str) -> str:
    """A suite's name as that of a file."""
    return suite.replace(" ", "_")


def _by_mass_or_case(
    name: str, caption: str, entries: list[Entry], chosen: pd.DataFrame, numbers: pd.DataFrame
) -> Table:
    """A table of a suite: by mass with one row of standing still, or by case with one in each."""
    if str(chosen["kind"].iloc[0]) not in SWEPT:
        rows = variant_rows(entries, by_case(chosen), still=True)
        return variant_table(name, caption, "Case", entries, rows, numbers)
    groups = [
        (f"{mass:g} kg" if case in set(chosen["suite"]) else str(case), group)
        for (case, mass), group in chosen.groupby(["case", "mass"], sort=False)
    ]
    rows = [*variant_rows(entries, groups), still_row(entries, chosen)]
    return variant_table(name, caption, "Mass", entries, rows, numbers)


def _papers(row: pd.Series, labels: Mapping[str, str]) -> list[float]:
    """The paper's errors at the mass and for the variant of a row; NaN where it has none."""
    paper = reported(str(row["kind"]), float(row["mass"]), labels.get(row["variant"], row["variant"]))
    return [np.nan] * len(ERRORS) if paper is None or paper == "absent" else list(paper)


def _paper_entry(summary: pd.DataFrame, error: str, labels: Mapping[str, str]) -> Entry:
    """The paper's error, and in brackets ours in parts of it; of pushes with what it does not say."""

    def cell(row: pd.Series) -> str:
        paper = reported(str(row["kind"]), float(row["mass"]), labels.get(row["variant"], row["variant"]))
        if paper is None or paper == "absent":
            return FAILS if paper is None else ABSENT
        value = paper[ERRORS.index(error)]
        ratio = float(row[error]) / value
        said = ([] if np.isnan(ratio) else [f"{ratio:.2f}"]) + regime(summary, row, error)
        return f"{value:.3f} ({'; '.join(said)})" if said else f"{value:.3f}"

    head = HEADS[error]
    return Entry(Column(f"paper {head.name}", latex=f"paper {head.latex}", role="paper"), cell)


def _ratio_entry(summary: pd.DataFrame, error: str, labels: Mapping[str, str]) -> Entry:
    """Ours, the paper's, and ours in parts of it; of errors that the paper does not have ours alone."""

    def cell(row: pd.Series) -> Cell:
        ours = float(row[error])
        if error == RAW:
            return measured(ours, none=FAILS)
        theirs = _papers(row, labels)[ERRORS.index(error)]
        beside = regime(summary, row, error) if np.isfinite(theirs) else []
        shown = [measured(one, none=FAILS) for one in (ours, theirs)]
        return f"{shown[0]} / {shown[1]} = {measured(ours / theirs, form='.2f')}" + (
            f" ({'; '.join(beside)})" if beside else ""
        )

    return Entry(ERROR_HEADS[error], cell, lambda rows: still_error(rows, error))


def _with_papers(chosen: pd.DataFrame, labels: Mapping[str, str]) -> pd.DataFrame:
    """The numbers with the paper's, `paper_<error>`, and ours in parts of them, `ratio_<error>`; NaN without any."""
    paper = np.array([_papers(row, labels) for _, row in chosen.iterrows()])
    columns = {f"paper_{name}": paper[:, place] for place, name in enumerate(ERRORS)}
    ratios = {f"ratio_{name}": chosen[name].to_numpy(np.float64) / columns[f"paper_{name}"] for name in ERRORS}
    return chosen.assign(**columns, **ratios)


def _caption(chosen: pd.DataFrame, kind: str, with_paper: bool) -> str:
    shares = set(chosen["partner_share"])
    whom = f"{kind} alone" if shares == {0.0} else f"cooperative {kind}" if min(shares) > 0 else kind
    like = f" (paper's Table {NUMBERS[kind]})" if kind in NUMBERS and asks_for_steps(chosen) else ""
    title = f"{whom}{like}" if kind in SWEPT else f"the suite {kind}"
    failed = f" {FAILS}: no trial survived." if (chosen["survived"] == 0).any() else ""
    aim = " Success here is survival in posture on feet that stay, with a push that goes on: the crate cannot move."
    beside = " Right, what the paper reports for its own commands, in brackets ours divided by it."
    return (
        f"Command tracking errors under {title}: means over surviving trials with their 95 % interval. "
        f"{conditions(chosen)} {measures(chosen)} Transport: parts of the commanded way that robot / object covered; "
        f"kept: part of the weight that the robot carries which rests in its hands, or how often what is pushed is not "
        f"lost at its side; success: survived, with enough of both; {STANDS_STILL}: what doing nothing scores, from "
        f"the script.{failed}{aim if kind == 'stagnation' else ''}{beside if with_paper else ''}"
    )
