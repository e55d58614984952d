"""`iowbc plan`: what would run, why, and how long that takes."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from iowbc.commands.printed import hanging, print_json, tell
from iowbc.commands.request import Request, in_order, prepared, recipes
from iowbc.commands.sweep_plan import Planned, in_all, plan_table, planned, time_of
from iowbc.pipeline.console.wording import KEY_LENGTH, short
from iowbc.pipeline.planner import Planner
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.stage_plan import StagePlan

REASONS_SHOWN = 8
"""Reasons of a stage that are printed; the rest is counted."""
REASON_INDENT = 4
"""Characters by which reasons stand to the right of their stage."""


def plan(request: Request, registry: Mapping[str, Stage], console: Console, as_json: bool = False) -> None:
    """Print what would run, and why; of a recipe of recipes a table of what would run of each."""
    asked = [prepared(one, request, registry)[0] for one in recipes(request)]
    each = [one for planner in asked for one in in_order(planner)]
    longest: dict[tuple[Path, tuple[str, ...]], Planner] = {}
    for one in each:  # a recipe may be asked for, and be what another one begins from
        known = longest.setdefault((one.loaded.file, one.loaded.overrides), one)
        if len(one.stages) > len(known.stages):
            longest[one.loaded.file, one.loaded.overrides] = one
    planners = list(longest.values())
    if as_json:
        names = [planner.loaded.recipe.name for planner in planners]
        steps = [[_data(step) for step in planner.plan()] for planner in planners]
        print_json(console, [{"recipe": name, "stages": own} for name, own in zip(names, steps, strict=True)])
    elif len(planners) == 1:
        _print(planners[0].plan(), console)
    else:
        _print_several(planned(planners), request, console)


def _print_several(found: Planned, request: Request, console: Console) -> None:
    """A row for each recipe, what the signs mean, and all together."""
    console.print(plan_table(found, "recipe"))
    steps = [stage.step for own in found.values() for stage in own if not stage.shared_with]
    rates = sorted({step.rate_of for step in steps if not step.cached and step.roughly is not None})
    if rates:
        console.print(f"~ at the rate of {', '.join(rates)}, from which it differs", highlight=False)
    console.print(in_all(found, "recipes"), highlight=False, soft_wrap=True)
    changing = [name for name, own in found.items() if not all(stage.step.cached for stage in own)]
    if changing:
        text = f"`iowbc plan {changing[-1]}` says why; so for {', '.join(changing[:-1])}" if changing[:-1] else ""
        text = text or f"`iowbc plan {changing[0]}` says why"
        tell(console, text)


def _print(steps: Sequence[StagePlan], console: Console) -> None:
    """What is planned for each stage, the reasons below it, and the time in all."""
    widest = max((len(step.stage.name) for step in steps), default=0)
    for step in steps:
        console.print(Text.assemble((step.stage.name.ljust(widest + 2), "bold"), _planned(step)))
        for line in _why(step):
            console.print(hanging(line, console.width, REASON_INDENT), markup=False, highlight=False)
    missing = [step for step in steps if not step.cached]
    count = f"{len(missing)} stage{'s' if len(missing) != 1 else ''} would run"
    rest = sum(step.guess is None for step in missing)
    if not missing:
        console.print("all stages are cached", highlight=False)
    elif rest == len(missing):
        console.print(f"{count}; how long that takes is not known", highlight=False)
    else:
        parts = [time_of(missing)]
        parts += [f"{rest} stage{'s' if rest != 1 else ''} of unknown length"] if rest else []
        console.print(f"{count}: {', and '.join(parts)}", highlight=False)


def _planned(step: StagePlan) -> Text:
    """Whether it is cached, and by which key, or would run, and for how long."""
    if step.cached:
        published = step.artifact is not None and step.artifact.published
        key = f"  {(step.key or '')[:KEY_LENGTH]}"
        return Text.assemble(("cached (published)" if published else "cached", "cyan"), (key, "dim"))
    takes = "" if step.guess is None else f", {time_of([step])}"
    if step.expected is None and step.roughly is not None:
        takes += f" at the rate of {step.rate_of}"
    return Text.assemble(("run", "bold yellow"), takes)


def _why(step: StagePlan) -> Sequence[str]:
    """A line for each reason and note."""
    return step.notes if step.cached else (*short(step.reasons, REASONS_SHOWN).splitlines(), *step.notes)


def _data(step: StagePlan) -> dict[str, Any]:
    """The same for other programs."""
    return {
        "stage": step.stage.name,
        "cached": step.cached,
        "published": step.cached and step.artifact is not None and step.artifact.published,
        "key": step.key,
        "reasons": step.reasons,
        "notes": step.notes,
        "expected_seconds": None if step.cached else step.expected,
        "expected_range": None if step.cached else [(step.expected or 0.0) * end for end in step.spread],
        "roughly_seconds": None if step.cached else step.roughly,
    }
