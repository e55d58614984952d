"""`iowbc bench carry`: a controller that others trained in the fixed suite, and its result on one page."""

import json
import os
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from iowbc.commands.needs import require_training
from iowbc.errors import UsageError
from iowbc.pipeline.store.digests import data_digest, file_digest
from iowbc.recipe.reading.finding import recipe_file
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.results.table import Column, Table, heads, markdown, measured

if TYPE_CHECKING:
    import pandas as pd

DECIDING = ("simulation", "task", "eval")
"""Sections of the suite that decide its trials."""
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


def carry(
    policy: str, adapter: str, *, arms: str, posture: bool, workers: int | None, out: Path, suite: Path | None = None
) -> None:
    """Play the suite and write the page. Raises UsageError, RecipeError, and StageFailed where the controller cannot
    be used.

    `adapter`: the name of a shipped one or a Python file; `posture`: whether it gets commanded height and pitch.
    """
    require_training("bench carry")
    from iowbc.adapters.source import SHIPPED, policy_digest, policy_path
    from iowbc.evaluation.acting import evaluated_policy
    from iowbc.evaluation.trials.protocol import Protocol, evaluated_world
    from iowbc.robot.description import robot_folder
    from iowbc.task.specification import Specification

    own = adapter not in SHIPPED
    if own and not Path(adapter).is_file():
        raise UsageError(f"--adapter {adapter}: no such file; give a Python file, or one of {', '.join(SHIPPED)}")
    if out.suffix != ".md":
        raise UsageError(f"--out {out}: a page is a Markdown file; give a name that ends in .md")
    file = suite or recipe_file("public").parent / "public" / "carry.yaml"
    digest = policy_digest(policy_path(policy))
    values: dict[str, object] = {
        "adapter": "own" if own else adapter,
        "policy": policy,
        "sha256": digest,
        "arms": arms,
        **({"module": str(Path(adapter).resolve())} if own else {}),
    }
    overrides = [f"eval.public.{name}={json.dumps(value)}" for name, value in values.items()]
    recipe = load_recipe(file, [*overrides, f"task.references.upright={json.dumps(not posture)}"]).recipe

    reached = 0

    def progress(done: float, total: float, note: str) -> None:
        nonlocal reached
        if int(10 * done / total) > reached:
            reached = int(10 * done / total)
            print(f"{done:.0f} of {total:.0f} trials, {note}", flush=True)

    world, cores = evaluated_world(Specification(recipe, robot_folder(recipe.robot))), os.cpu_count() or 1
    acting = evaluated_policy(world, None)
    with tempfile.TemporaryDirectory(prefix="iowbc-carry-") as work:
        trials = Protocol(world, acting, work=Path(work), workers=workers or cores, progress=progress).run()
    source = Path(adapter) if own else Path(SHIPPED[adapter].__code__.co_filename)
    given, controller = "height and pitch" if posture else "velocities alone", recipe.eval.public
    assert controller is not None, "it is among the overrides"
    rows = {
        "controller": f"{Path(policy.partition(':')[2] or policy).name}, SHA-256 {digest}",
        "adapter": f"{source.name}, SHA-256 {file_digest(source)}",
        "suite": f"{file.stem} of iowbc {version('iowbc')}, SHA-256 {suite_digest(load_recipe(file).recipe)}",
        "settings": f"arms {arms}, {given}, heading gain {controller.heading_gain:g} 1/s",
        "trials": f"{len(trials)}, {recipe.eval.trials} a cell; {int(trials['succeeded'].sum())} succeeded",
    }
    head = "\n".join(f"| {name} | {text} |" for name, text in rows.items())
    table = _suite_table(trials)
    page = f"# Carry bench\n\n| | |\n| --- | --- |\n{head}\n\n{markdown(table)}\n{MEANING}\n"
    out.write_text(page, encoding="utf-8")
    print(markdown(table), end="")
    if _falls_early(trials):
        print("it falls at once without an object: compare joint order, gains and scales with those of its training")
    print(f"page  {out}")


def suite_digest(suite: Recipe) -> str:
    """SHA-256 of what decides the trials of a suite, whatever controller plays them."""
    values = deciding(suite)
    return data_digest({name: values[name] for name in DECIDING})


def _suite_table(trials: "pd.DataFrame") -> Table:
    """A row for each suite and mass."""
    from iowbc.evaluation.report.aggregate import aggregate

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


def _falls_early(trials: "pd.DataFrame") -> bool:
    """True where it falls at once without an object, which points to its adapter."""
    alone = trials.loc[(trials["mass"] == 0) & ~trials["survived"], "seconds"]
    return len(alone) == int((trials["mass"] == 0).sum()) > 0 and bool(alone.mean() < EARLY)
