"""Runs, with those that differ only in their seed in one group; tables of their metrics and of their trainings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.pipeline.console.wording import figure
from iowbc.pipeline.nested import flattened
from iowbc.pipeline.store.artifact import Artifact
from iowbc.recipe.recipe import SEEDS
from iowbc.results.table import ABSENT, Cell, Column, MeanCell, Table, heads
from iowbc.stages.registry import STAGES

AMOUNT = ("eval.trials.", "eval.robustness.", "eval.map.")
"""How much an evaluation plays: trainings of one variant may differ in it."""


@dataclass(frozen=True)
class Run:
    """The artifacts of a recipe, or a single one, under the word by which the user called it."""

    label: str
    artifacts: Mapping[str, Artifact]
    """By stage: all that a recipe used last, or the one artifact that was named."""
    recipe: Mapping[str, Any] = field(default_factory=dict)
    """Resolved; empty for a single artifact."""
    shipped: Mapping[str, Artifact] = field(default_factory=dict)
    """Published artifacts of the recipe for stages without an own artifact, by stage."""

    @property
    def usable(self) -> dict[str, Artifact]:
        """All artifacts, own and published, by stage."""
        return {**self.shipped, **self.artifacts}


@dataclass(frozen=True)
class Group:
    """Runs of one recipe with different seeds."""

    label: str
    runs: tuple[Run, ...]

    @property
    def seeds(self) -> tuple[str, ...]:
        """Seed of each run's training; where seeds are equal, the labels of the runs."""
        for path in ("skill.learning.seed", "teacher.seed", "seed"):
            own = [flattened(run.recipe).get(path) for run in self.runs]
            if any(seed is not None for seed in own):
                usual = [run.recipe.get("seed", 0) for run in self.runs]
                seeds = tuple(str(usual[place] if seed is None else seed) for place, seed in enumerate(own))
                if len({*seeds}) == len(seeds):
                    return seeds
        return tuple(run.label for run in self.runs)

    def values(self, stage: str, metric: str) -> NDArray[np.float64]:
        """A stage's metric in each run that has it."""
        found = [run.artifacts[stage].metrics.get(metric) for run in self.runs if stage in run.artifacts]
        return np.array([value for value in found if value is not None], np.float64)


def grouped(runs: Sequence[Run]) -> list[Group]:
    """Runs by recipe, seeds together, in order of appearance; a group of several is called by its first run."""
    found: list[list[Run]] = []
    for run in runs:
        group = next((group for group in found if _of_one_variant(run, group[0])), None)
        if group is None:
            found.append(group := [])
        group.append(run)
    return [
        Group(group[0].label if len(group) == 1 else f"{group[0].label} ({len(group)} seeds)", tuple(group))
        for group in found
    ]


def metrics_table(groups: Sequence[Group]) -> Table:
    """The metrics in which groups differ, or all of a single one: mean, half the spread over seeds, Δ to the first."""
    names: dict[str, dict[str, None]] = {}
    for run in (run for group in groups for run in group.runs):
        for stage, artifact in run.artifacts.items():
            names.setdefault(stage, {}).update(dict.fromkeys(artifact.metrics))
    rows: list[tuple[Cell, ...]] = []
    for stage, metric in ((stage, metric) for stage, metrics in names.items() for metric in metrics):
        values = [group.values(stage, metric) for group in groups]
        if len(groups) == 1 or not all(_alike(own, values[0]) for own in values[1:]):
            row: list[Cell] = [stage, metric, _cell(values[0])]
            for own in values[1:]:  # a difference is empty where either is unknown
                known = len(own) and len(values[0])
                row += [_cell(own), figure(own.mean() - values[0].mean(), 3, "+") if known else ""]
            rows.append(tuple(row))
    others = [head for group in groups[1:] for head in (Column(group.label, role="detail"), f"Δ {group.label}")]
    return Table("metrics", "", heads("stage", "metric", groups[0].label, *others), rows, grouped=False)


def _alike(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """True for the same values in any order; of groups of different size, for the same values without repetitions."""
    ordered = np.sort if len(one) == len(other) else np.unique
    return np.array_equal(ordered(one), ordered(other))


def _cell(values: NDArray[np.float64]) -> Cell:
    mean = figure(values.mean()) if len(values) else ""
    return MeanCell(mean, f"{np.ptp(values) / 2:.2g}") if len(values) > 1 else mean


def trainings_table(groups: Sequence[Group], missing: Sequence[str] = ()) -> Table:
    """Length and seed of each training behind a comparison, a row a run; `missing`: recipes that have not run."""
    import pandas as pd

    used = {stage for group in groups for run in group.runs for stage in run.recipe.get("stages", ())}
    named = [STAGES[name] for name in STAGES if name in used | {"teacher", "distill"}]
    methods = {stage.name: stage.trained_by for stage in named if stage.trained_by}
    numbers = [
        {"recipe": run.label, "algorithm": _evaluated(run)["eval"]["label"], "seed": seed}
        | {stage: _steps_of(run, stage) for stage in methods}
        for group in groups
        for run, seed in zip(group.runs, group.seeds, strict=True)
    ]
    rows = [
        tuple(ABSENT if n is None else f"{n:,}" if isinstance(n, int) else n for n in one.values()) for one in numbers
    ]
    rows += [(name, "not evaluated yet", *[ABSENT] * (1 + len(methods))) for name in missing]
    columns = heads("Recipe", "Algorithm", "Seed", *(f"Steps of {method}" for method in methods.values()))
    budgets = {row["teacher"] for row in numbers}
    budget = "" if budgets == {None} else f", {'' if len(budgets) == 1 else 'not '}all with the same budget of PPO"
    lacking = f" Missing: {', '.join(missing)}." if missing else ""
    caption = f"What was trained{budget}.{lacking}"
    return Table("trainings", caption, columns, rows, pd.DataFrame(numbers))


def _evaluated(run: Run) -> Mapping[str, Any]:
    """The recipe of a run's evaluation, whose label its trials have; of a run without one its own."""
    return run.artifacts["eval"].recipe if "eval" in run.artifacts else run.recipe


def _steps_of(run: Run, stage: str) -> int | None:
    """Environment steps of a stage that trains; None where the run has no such stage."""
    if stage not in run.recipe.get("stages", ()):
        return None
    made = run.artifacts[stage].recipe if stage in run.artifacts else run.recipe
    (counted, *_) = STAGES[stage].counts or (f"{stage}.steps",)
    return int(flattened(made)[counted])


def _of_one_variant(first: Run, second: Run) -> bool:
    """True if two runs differ only in their seeds, and then perhaps in how much is evaluated: in their recipes or, if
    both are evaluated, in the ingredients of their artifacts' keys, which also match for recipes recorded by different
    versions of the program. Runs of one seed differ in what they begin from."""
    recipes = [_seedless(run.recipe) for run in (first, second)]
    seeds = [_seeds(run.recipe) for run in (first, second)]
    if recipes[0] and recipes[0] == recipes[1]:
        return True
    if all(recipes) and _method(recipes[0]) == _method(recipes[1]) and seeds[0] != seeds[1]:
        return True
    shared = sorted(first.artifacts.keys() & second.artifacts.keys())

    def made(run: Run) -> tuple[tuple[Any, ...], list[Any]]:
        """Label, robots and recipes without seeds, which must be equal; and the seeds."""
        keyed = [run.artifacts[stage].ingredients for stage in shared]
        own = [one.get("recipe", {}) for one in keyed]
        label, robots = run.recipe.get("eval", {}).get("label"), [one.get("robot") for one in keyed]
        return (label, robots, [_method(_seedless(one)) for one in own]), [_seeds(one) for one in own]

    (alike, drawn), (other, others) = made(first), made(second)
    return "eval" in shared and all(alike[-1]) and alike == other and drawn != others


def _seeds(recipe: Mapping[str, Any]) -> list[Any]:
    return [flattened(recipe).get(path) for path in SEEDS]


def _seedless(recipe: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a recipe by dotted path, without its seeds, name, description and execution."""
    own = {name: value for name, value in recipe.items() if name not in ("name", "description", "execution")}
    return {path: value for path, value in flattened(own).items() if path not in SEEDS} if own else {}


def _method(values: Mapping[str, Any]) -> dict[str, Any]:
    """The values without `AMOUNT`."""
    return {path: value for path, value in values.items() if not f"{path}.".startswith(AMOUNT)}
