"""What a sweep, or a recipe of recipes, would run: each stage counted once, however many recipes share it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from iowbc.commands.printed import plain_table, print_json
from iowbc.pipeline.console.wording import duration
from iowbc.pipeline.ingredients import key_values
from iowbc.pipeline.planner import Planner
from iowbc.pipeline.stage_plan import StagePlan
from iowbc.pipeline.store.digests import data_digest
from iowbc.recipe.reading.sweep import Sweep


@dataclass(frozen=True)
class PlannedStage:
    """A stage of a point."""

    step: StagePlan
    shared_with: str
    """The earlier recipe that makes it; empty where this one does, or where it is cached."""


Planned = Mapping[str, Sequence[PlannedStage]]
"""The stages of each recipe, by its name."""


def planned(planners: Sequence[Planner]) -> Planned:
    """The stages of each recipe, as things stand; nothing is changed."""
    makers: dict[str, str] = {}
    found: dict[str, list[PlannedStage]] = {}
    for planner in planners:
        name = planner.loaded.recipe.name
        identities: dict[str, str] = {}
        own = found.setdefault(name, [])
        for step in planner.plan():
            identity = identities[step.stage.name] = _identity(planner, step, identities)
            maker = name if step.cached else makers.setdefault(identity, name)
            own.append(PlannedStage(step, "" if maker == name else maker))
    return found


def _identity(planner: Planner, step: StagePlan, before: Mapping[str, str]) -> str:
    """What stands for a stage's key while those of the stages that it reads are not known."""
    if step.key is not None:
        return step.key
    ingredients = {
        "stage": step.stage.name,
        "recipe": key_values(planner.loaded.recipe, planner.deciding, step.stage),
        "robot": planner.robot_digest,
        "inputs": {name: before[name] for name in planner.reads(step.stage)},
        "borrowed": {name: one.named for name, one in step.stage.borrows(planner.loaded.recipe).items()},
    }
    return data_digest(ingredients)


def in_all(found: Planned, what: str = "points") -> str:
    """How much there is to do, in a sentence; `what`: the recipes' part in it."""
    stages = [stage for own in found.values() for stage in own]
    made = [stage.step for stage in stages if not stage.step.cached and not stage.shared_with]
    shared = sum(bool(stage.shared_with) for stage in stages)
    cached = sum(stage.step.cached for stage in stages)
    head = f"{len(found)} {what}: {len(made)} stages would run, {shared} are shared, {cached} cached"
    if not made:
        return f"{len(found)} {what}: all stages are cached"
    rest = sum(step.guess is None for step in made)
    if rest == len(made):
        return f"{head}; how long that takes is not known"
    unknown = f", and {rest} of unknown length" if rest else ""
    return f"{head}; {time_of(made)} one after another{unknown}"


def time_of(steps: Sequence[StagePlan]) -> str:
    """The time that stages take together, as far as it is known: a range, or a guess where one of them has no more."""
    known = [step for step in steps if step.guess is not None]
    if any(step.expected is None for step in known):
        return f"a guess: {duration(sum(step.guess or 0.0 for step in known))}"
    low, high = (duration(sum((step.expected or 0.0) * step.spread[end] for step in known)) for end in (0, 1))
    return f"{low} to {high}" if low != high else f"about {low}"


def print_plan(sweep: Sweep, found: Planned, console: Console, as_json: bool = False) -> None:
    """A row for each point, and all together."""
    if as_json:
        print_json(console, {"sweep": sweep.name, "points": [_data(sweep, name, own) for name, own in found.items()]})
        return
    console.print(plan_table(found, "point"))
    console.print(in_all(found), highlight=False)


def plan_table(found: Planned, what: str) -> Table:
    """A row for each recipe, a column for each stage; `what` stands above the recipes' names.

    A stage that would run has the time that it takes, without a word, so that six stages fit on 80 characters.
    """
    names = list(dict.fromkeys(stage.step.stage.name for own in found.values() for stage in own))
    table = plain_table(what, *names)
    for recipe, own in found.items():
        cells = {stage.step.stage.name: _cell(stage) for stage in own}
        table.add_row(recipe, *(cells.get(name, "") for name in names))
    return table


def _cell(stage: PlannedStage) -> Text | str:
    if stage.step.cached:
        published = stage.step.artifact is not None and stage.step.artifact.published
        return Text("published" if published else "cached", style="cyan")
    if stage.shared_with:
        return Text("shared", style="dim")
    sign = "~" if stage.step.expected is None and stage.step.roughly is not None else ""
    return Text(f"{sign}{duration(stage.step.guess)}" or "run", style="bold yellow")


def _data(sweep: Sweep, name: str, own: Sequence[PlannedStage]) -> dict[str, Any]:
    settings = next(point.settings for point in sweep.points if point.name == name)
    stages = [
        {
            "stage": stage.step.stage.name,
            "cached": stage.step.cached,
            "shared_with": stage.shared_with or None,
            "key": stage.step.key,
            "expected_seconds": None if stage.step.cached or stage.shared_with else stage.step.expected,
        }
        for stage in own
    ]
    return {"point": name, "settings": dict(settings), "stages": stages}
