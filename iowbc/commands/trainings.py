"""What stands behind a comparison: how long each policy was trained, with which seed, and what is still missing."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from iowbc.results.table import ABSENT, Table, heads
from iowbc.stages.registry import STAGES

if TYPE_CHECKING:
    from iowbc.report.runs import Group, Run

NOT_TRAINED = "not evaluated yet"


def trainings_table(groups: "Sequence[Group]", missing: Sequence[str] = ()) -> Table:
    """A row for each run; `missing`: recipes that belong to the comparison and have not run."""
    import pandas as pd

    named = {stage for group in groups for run in group.runs for stage in run.recipe.get("stages", ())}
    named |= {"teacher", "distill"}
    methods = {name: STAGES[name].presentation.trained_by for name in STAGES if name in named}
    methods = {name: method for name, method in methods.items() if method}
    rows: list[tuple[str, ...]] = []
    numbers: list[dict[str, object]] = []
    for group in groups:
        for run, seed in zip(group.runs, group.seeds, strict=True):
            steps = {stage: steps_of(run, stage) for stage in methods}
            told = [ABSENT if count is None else f"{count:,}" for count in steps.values()]
            label = str(run.recipe["eval"]["label"])
            rows.append((run.label, label, seed, *told))
            numbers.append({"recipe": run.label, "algorithm": label, "seed": seed, **steps})
    rows += [(name, NOT_TRAINED, *[ABSENT] * (1 + len(methods))) for name in missing]
    columns = heads("Recipe", "Algorithm", "Seed", *(f"Steps of {method}" for method in methods.values()))
    return Table("trainings", _caption(numbers, missing), columns, rows, pd.DataFrame(numbers))


def steps_of(run: "Run", stage: str) -> int | None:
    """Environment steps of a stage that trains; None where the run has no such stage."""
    if stage not in run.recipe.get("stages", ()):
        return None
    made: Any = run.artifacts[stage].recipe if stage in run.artifacts else run.recipe
    for part in STAGES[stage].counts[0].split("."):
        made = made[part]
    return int(made)


def _caption(numbers: Sequence[dict[str, object]], missing: Sequence[str]) -> str:
    budgets = {row["teacher"] for row in numbers}
    told = "all with the same budget of PPO" if len(budgets) == 1 else "not all with the same budget of PPO"
    lacking = f" Missing: {', '.join(missing)}." if missing else ""
    return f"What was trained, {told}.{lacking}"
