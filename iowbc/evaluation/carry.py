"""The carry bench: the fixed suite played by a controller that others trained, and its result on one page."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from iowbc.evaluation.acting import evaluated_policy
from iowbc.evaluation.report.aggregate import aggregate
from iowbc.evaluation.trials.protocol import Protocol, evaluated_world
from iowbc.recipe.recipe import Recipe
from iowbc.results.table import Column, Table, heads, measured
from iowbc.task.specification import Specification

EARLY = 2.0
"""Mean time to a fall without an object that points to an adapter that does not fit [s]: a walker stands so long."""
FIGURES = {
    "E_v": (Column("E_v", "m/s"), ".3f"),
    "E_psi": (Column("E_ψ", "rad"), ".3f"),
    "transport_robot": (Column("way"), ".2f"),
    "hand_force_p95": (Column("hand", "N"), ".0f"),
    "handle_force_p95": (Column("handle", "N"), ".0f"),
}
"""Columns of the page and their formats."""
MEANING = (
    "E_v and E_ψ: errors of velocity and heading, means over the trials that were survived. Way: part of the commanded "
    "way covered; hand, handle: 95th percentile of the horizontal force between a hand and the object, and between "
    "partner and object; time: until the end or the fall; means over all trials."
)


def play_suite(
    recipe: Recipe, robot: Path, workers: int, progress: Callable[[float, float, str], None]
) -> pd.DataFrame:
    """The long table of all trials of a recipe with a public controller. Raises StageFailed where it cannot be used."""
    world = evaluated_world(Specification(recipe, robot))
    policy = evaluated_policy(world, None)
    with tempfile.TemporaryDirectory(prefix="iowbc-carry-") as work:
        return Protocol(world, policy, work=Path(work), workers=workers, progress=progress).run()


def suite_table(trials: pd.DataFrame) -> Table:
    """A row for each suite and mass."""
    summary = aggregate(trials)
    seconds = trials.groupby(["suite", "case", "mass"])["seconds"].mean()
    rows = [
        (
            str(row["suite"]),
            f"{row['mass']:g} kg" if row["mass"] else "no object",
            f"{row['survived']}/{row['trials']}",
            f"{row['succeeded']}/{row['trials']}",
            f"{seconds[row['suite'], row['case'], row['mass']]:.1f}",
            *(measured(float(row[name]), form=form) for name, (_, form) in FIGURES.items()),
        )
        for _, row in summary.iterrows()
    ]
    own = ("suite", "load", "survived", "succeeded", Column("time", "s"))
    columns = heads(*own, *(head for head, _ in FIGURES.values()))
    return Table("carry", "", columns, rows, summary)


def falls_early(trials: pd.DataFrame) -> bool:
    """True where it falls at once without an object, which points to its adapter."""
    alone = trials.loc[(trials["mass"] == 0) & ~trials["survived"], "seconds"]
    return len(alone) == int((trials["mass"] == 0).sum()) > 0 and bool(np.mean(alone) < EARLY)
