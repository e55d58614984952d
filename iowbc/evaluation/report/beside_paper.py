"""Every cell of the paper's Tables II and III: ours, the paper's, and the ratio."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from iowbc.evaluation.paper import TABLES, VARIANTS, reported
from iowbc.evaluation.report.aggregate import asks_for_steps, suites_of
from iowbc.evaluation.report.captions import in_common
from iowbc.evaluation.report.error_tables import ANY_MASS, LATEX_TOLD, NO_LABELS, NUMBERS, RAW, STANDS_STILL, TOLD
from iowbc.evaluation.report.regime import regime
from iowbc.evaluation.report.tables import ABSENT, FAILS, Table
from iowbc.evaluation.trials.errors import ERRORS

CELL = "{} / {} = {}"
"""Ours, the paper's, and ours in parts of it."""
PLACE = list(TOLD).index(RAW)
"""Of our velocity error without averaging, among the errors."""


def paper_table(summary: pd.DataFrame, labels: Mapping[str, str] = NO_LABELS) -> Table | None:
    """The masses of the paper's tables that were played walking, for each of its variants; None where there are none.

    labels: the paper's name of variants that go by another one here.
    """
    rows, numbers, counted = [], [], []
    for suite in suites_of(summary, *NUMBERS):
        chosen = summary[summary["suite"] == suite]
        if not asks_for_steps(chosen):
            continue
        kind = str(chosen["kind"].iloc[0])
        for variant, own in chosen.groupby("variant", sort=False):
            label = labels.get(str(variant), str(variant))
            if label not in VARIANTS:
                continue
            at_most, of = 0, 0
            for mass in TABLES[kind]:
                for _, row in own[own["mass"] == mass].iterrows():
                    paper = reported(kind, mass, label)
                    theirs = [np.nan] * len(ERRORS) if paper is None or paper == "absent" else list(paper)
                    ours = [float(row[name]) for name in ERRORS]
                    survived = f"{row['survived']}/{row['trials']}"
                    cells = [
                        _cell(own, one, regime(summary, row, name) if np.isfinite(one) else [])
                        for name, own, one in zip(ERRORS, ours, theirs, strict=True)
                    ]
                    cells.insert(PLACE, _told(float(row[RAW])))
                    rows.append((f"{NUMBERS[kind]}, {suite}", str(variant), f"{mass:g} kg", survived, *cells))
                    numbers += _numbers(suite, str(variant), mass, ours, theirs)
                    at_most += sum(one <= other for one, other in zip(ours, theirs, strict=True))
                    of += int(np.isfinite(theirs).sum())
            counted += [f"{variant} in {suite} {at_most} of {of}"] if of else []
        if rows and rows[-1][0] == f"{NUMBERS[kind]}, {suite}":
            still = [f"{float(chosen[f'still_{name}'].mean()):.3f}" for name in ERRORS]
            still.insert(PLACE, still[PLACE - 1])
            rows.append((f"{NUMBERS[kind]}, {suite}", STANDS_STILL, ANY_MASS, ABSENT, *still))
    if not rows:
        return None
    columns = ("Table", "Algorithm", "Mass", "Survived")
    return Table(
        "paper",
        "Tables II and III cell by cell: ours / the paper's = ratio, means over surviving trials; the paper's are for "
        f"its own commands. {FAILS}: no trial survived. Cells with a number of the paper's in which ours is at most as "
        f"large: {', '.join(counted)}. {STANDS_STILL}: what doing nothing scores, from the script. "
        f"{in_common(summary)}",
        (*columns, *TOLD.values()),
        (*columns, *LATEX_TOLD.values()),
        tuple(rows),
        pd.DataFrame(numbers),
    )


def _cell(ours: float, theirs: float, beside: Sequence[str]) -> str:
    ratio = ours / theirs
    cell = CELL.format(_told(ours), _told(theirs), ABSENT if np.isnan(ratio) else f"{ratio:.2f}")
    return f"{cell} ({'; '.join(beside)})" if beside else cell


def _told(value: float) -> str:
    return FAILS if np.isnan(value) else f"{value:.3f}"


def _numbers(suite: str, variant: str, mass: float, ours: list[float], theirs: list[float]) -> list[dict[str, object]]:
    return [
        {"suite": suite, "variant": variant, "mass": mass, "error": name, "ours": own, "paper": other}
        | {"ratio": own / other}
        for name, own, other in zip(ERRORS, ours, theirs, strict=True)
    ]
