"""`iowbc plan`: stages that would run, the reasons, and the time, for a recipe or a study."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from iowbc.commands import options
from iowbc.commands.printed import hanging, plain_table, print_json, shown_path, stdout_console, tell
from iowbc.commands.request import Request, in_order, planners
from iowbc.files import data_digest
from iowbc.pipeline.console.wording import KEY_LENGTH, duration, short
from iowbc.pipeline.planner import Planner, Plans
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.stage_plan import Options, StagePlan
from iowbc.pipeline.store.runs import Runs

REASONS_SHOWN = 8
"""Reasons of a stage that are printed; the rest is counted."""
REASON_INDENT = 4
"""Indentation of reasons below their stage [characters]."""


Planned = Mapping[str, Sequence[StagePlan]]
"""The stages of each recipe, by its name."""


def plan(
    recipe: options.RecipeFile,
    overrides: options.Overrides = None,
    until: options.Until = None,
    force: options.Force = None,
    on_code_change: options.OnCodeChange = "report",
    as_json: options.AsJson = False,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Print the stages that would run, and why; for several recipes, as of a study, a table."""
    asked = Options(until, frozenset(force or ()), on_code_change=on_code_change)
    request, console = Request(recipe, overrides or (), Runs(runs), asked), stdout_console()
    plans: Plans = {}
    each = [one for planner in planners(request) for one in in_order(planner, plans)]
    longest: dict[tuple[Path, tuple[str, ...]], Planner] = {}
    for one in each:  # a recipe may be both requested and an origin of another one
        place = one.loaded.file, one.loaded.overrides
        longest[place] = max(longest.get(place, one), one, key=lambda planner: len(planner.stages))
    found = list(longest.values())
    if as_json:
        data = [{"recipe": one.loaded.recipe.name, "stages": list(map(step_data, one.plan(plans)))} for one in found]
        print_json(console, data)
    elif len(found) == 1:
        _print(found[0].plan(plans), console)
    else:
        _print_several(request, found, plans, console)


def planned(planners: Sequence[Planner], known: Plans | None = None) -> Planned:
    """The stages of each recipe, those that several share once; `known`: plans that were just made."""
    makers: dict[str, str] = {}
    found: dict[str, list[StagePlan]] = {}
    for planner in planners:
        name = planner.loaded.recipe.name
        if name in found:  # an origin of its own, with other values
            name = shlex.join([name, *(word for value in planner.loaded.overrides for word in ("--set", value))])
        identities: dict[str, str] = {}
        own = found.setdefault(name, [])
        for step in planner.plan(known):
            identity = identities[step.stage.name] = step.key or _identity(planner, step.stage, identities)
            maker = name if step.cached else makers.setdefault(identity, name)
            own.append(replace(step, shared_with="" if maker == name else maker))
    return found


def _identity(planner: Planner, stage: Stage, before: Mapping[str, str]) -> str:
    """Substitute for a stage's key while the keys of its inputs are unknown."""
    ingredients = {
        "stage": stage.name,
        "recipe": stage.key_values(planner.loaded.recipe, planner.deciding),
        "robot": planner.robot_digest,
        "inputs": {name: before[name] for name in stage.reads(planner.loaded.recipe)},
        "borrowed": {name: one.named for name, one in stage.borrows(planner.loaded.recipe).items()},
    }
    return data_digest(ingredients)


def _print_several(request: Request, planners: Sequence[Planner], known: Plans, console: Console) -> None:
    """Print a row for each recipe, a legend, the total, and a command that gives reasons."""
    found = planned(planners, known)
    console.print(plan_table(found, "recipe"))
    steps = [step for own in found.values() for step in own if not step.shared_with]
    rates = sorted({step.rate_of for step in steps if not step.cached and step.roughly is not None})
    if rates:
        console.print(f"~ at the rate of {', '.join(rates)}, from which it differs", highlight=False)
    console.print(in_all(found, "recipes"), highlight=False, soft_wrap=True)
    rows = zip(found.items(), planners, strict=False)
    changing = [(name, one.loaded) for (name, own), one in rows if not all(step.cached for step in own)]
    if changing:
        *others, (_, last) = changing
        also = f"; so for {', '.join(name for name, _ in others)}" if others else ""
        alone = Request(shown_path(last.file), last.overrides, request.runs, Options(), "plan")
        tell(console, f"`{alone.command()}` says why{also}")


def in_all(found: Planned, what: str = "points") -> str:
    """Total work in a sentence; `what`: noun for the recipes."""
    steps = [step for own in found.values() for step in own]
    made = [step for step in steps if not step.cached and not step.shared_with]
    shared = sum(bool(step.shared_with) for step in steps)
    cached = sum(step.cached for step in steps)
    if not made:
        return f"{len(found)} {what}: all stages are cached"
    counts = f"{len(made)} stages would run, {shared} are shared, {cached} cached"
    return f"{len(found)} {what}: {counts}; {time_of(made, ' one after another')}"


def time_of(steps: Sequence[StagePlan], manner: str = "") -> str:
    """Total time of stages: a range, or a guess if any is only guessed; and the number of unknown ones."""
    known = [step for step in steps if step.guess is not None]
    if not known:
        return "how long that takes is not known"
    low, high = (duration(sum((step.expected or 0.0) * step.spread[end] for step in known)) for end in (0, 1))
    text = f"{low} to {high}" if low != high else f"about {low}"
    if any(step.expected is None for step in known):
        text = f"a guess: {duration(sum(step.guess or 0.0 for step in known))}"
    unknown = f", and {len(steps) - len(known)} of unknown length" if len(known) < len(steps) else ""
    return f"{text}{manner}{unknown}"


def plan_table(found: Planned, what: str) -> Table:
    """A row for each recipe, headed by `what`, and a column for each stage, six of which fit on 80 characters."""
    names = list(dict.fromkeys(step.stage.name for own in found.values() for step in own))
    table = plain_table(what, *names)
    for recipe, own in found.items():
        cells = {step.stage.name: _cell(step) for step in own}
        table.add_row(Text(recipe), *(cells.get(name, "") for name in names))
    return table


def _cell(step: StagePlan) -> Text:
    if step.cached:
        return Text("published" if step.published else "cached", style="cyan")
    if step.shared_with:
        return Text("shared", style="dim")
    sign = "~" if step.expected is None and step.roughly is not None else ""
    return Text(f"{sign}{duration(step.guess)}" or "run", style="bold yellow")


def _print(steps: Sequence[StagePlan], console: Console) -> None:
    widest = max((len(step.stage.name) for step in steps), default=0)
    for step in steps:
        console.print(Text.assemble((step.stage.name.ljust(widest + 2), "bold"), _described(step)))
        for line in (*short(step.reasons, REASONS_SHOWN).splitlines(), *step.notes):
            console.print(hanging(line, console.width, REASON_INDENT), markup=False, highlight=False)
    missing = [step for step in steps if not step.cached]
    count = f"{len(missing)} stage{'s' if len(missing) != 1 else ''} would run"
    console.print(f"{count}; {time_of(missing)}" if missing else "all stages are cached", highlight=False)


def _described(step: StagePlan) -> Text:
    if step.cached:
        key = f"  {step.key[:KEY_LENGTH]}"
        return Text.assemble(("cached (published)" if step.published else "cached", "cyan"), (key, "dim"))
    takes = "" if step.guess is None else f", {time_of([step])}"
    if step.expected is None and step.roughly is not None:
        takes += f" at the rate of {step.rate_of}"
    return Text.assemble(("run", "bold yellow"), takes)


def step_data(step: StagePlan) -> dict[str, Any]:
    """The step for other programs."""
    return {
        "stage": step.stage.name,
        "cached": step.cached,
        "published": step.published,
        "key": step.key or None,
        "reasons": step.reasons,
        "notes": step.notes,
        "expected_seconds": None if step.cached else step.expected,
        "expected_range": None if step.cached or not step.expected else [step.expected * end for end in step.spread],
        "roughly_seconds": None if step.cached else step.roughly,
    }
