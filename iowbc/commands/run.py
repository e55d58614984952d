"""`iowbc run` and `iowbc plan`: from a recipe file to an exit code, with signals, console and tracking around it."""

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from iowbc.commands.results import print_results
from iowbc.errors import Interrupted, PipelineFailed, Problem, RecipeError
from iowbc.pipeline.console.display import Display, PlainDisplay
from iowbc.pipeline.console.live_table import LiveDisplay
from iowbc.pipeline.console.wording import KEY_LENGTH, duration, short
from iowbc.pipeline.planner import Options, Planner, Step
from iowbc.pipeline.runner import Runner
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.stop_request import StopRequest
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.tracking.tracker import Tracker, backlog
from iowbc.pipeline.writability import require_writable_runs
from iowbc.recipe.reading.loading import LoadedRecipe, load_recipe

DONE, STAGE_FAILED, INTERRUPTED = 0, 1, 130
"""Exit codes."""
REASONS_SHOWN = 8
"""Reasons of a stage that a plan prints; the rest is counted."""


@dataclass(frozen=True)
class Request:
    """What `iowbc run` was asked for."""

    file: Path
    overrides: Sequence[str]
    runs: Runs
    options: Options

    def command(self, forced: Sequence[str]) -> str:
        """The command that goes on with this run; `forced` stages are still to be made anew."""
        words = ["iowbc", "run", str(self.file)]
        for override in self.overrides:
            words += ["--set", override]
        if self.options.until:
            words += ["--until", self.options.until]
        for stage in sorted(forced):
            words += ["--force", stage]
        if self.options.workers:
            words += ["--workers", str(self.options.workers)]
        if self.options.on_code_change != "report":
            words += ["--on-code-change", self.options.on_code_change]
        if self.runs.root != Path("runs"):
            words += ["--runs", str(self.runs.root)]
        return shlex.join(words)


def prepared(request: Request, registry: Mapping[str, Stage]) -> tuple[Planner, Path]:
    """The planner of a request and the robot's folder. Raises `RecipeError` for all that is wrong before a run."""
    from iowbc.commands.robot_check import check_against_robot
    from iowbc.robot.description import robot_folder

    loaded = load_recipe(request.file, request.overrides)
    try:
        robot = robot_folder(loaded.recipe.robot)
    except FileNotFoundError as error:
        raise RecipeError([Problem(loaded.place("robot"), f"key 'robot' = '{loaded.recipe.robot}': {error}")]) from None
    check_against_robot(loaded, robot)
    return Planner(loaded, registry, Store(request.runs), robot, request.options), robot


def plan(request: Request, registry: Mapping[str, Stage], console: Console) -> int:
    """Print what would run, and why."""
    planner, _ = prepared(request, registry)
    steps = planner.plan()
    table = Table(box=None, padding=(0, 1))
    for name in ("stage", "plan", "why", "takes about"):
        table.add_column(name, no_wrap=name != "why")
    for step in steps:
        table.add_row(*_row(step))
    console.print(table)
    missing = [step for step in steps if not step.cached]
    count = f"{len(missing)} stage{'s' if len(missing) != 1 else ''} would run"
    known = [step.expected for step in missing if step.expected is not None]
    if not missing:
        console.print("all stages are cached", highlight=False)
    elif not known:
        console.print(f"{count}; how long that takes is not known", highlight=False)
    else:
        rest = len(missing) - len(known)
        parts = [f"about {duration(sum(known))}"]
        parts += [f"{rest} stage{'s' if rest != 1 else ''} of unknown length"] if rest else []
        console.print(f"{count}: {', and '.join(parts)}", highlight=False)
    return DONE


def _row(step: Step) -> tuple[str | Text, ...]:
    """Stage, what is planned for it, why, and the time that it takes."""
    if step.cached:
        why = "\n".join(step.notes) or (step.key or "")[:KEY_LENGTH]
        return step.stage.name, Text("cached", style="cyan"), Text(why), ""
    why = "\n".join((short(step.reasons, REASONS_SHOWN), *step.notes))
    return step.stage.name, Text("run", style="bold yellow"), Text(why), duration(step.expected)


def run(request: Request, registry: Mapping[str, Stage], console: Console) -> int:
    """Run a recipe to its end, a failure or an interruption; returns the exit code. Raises `RecipeError`."""
    planner, robot = prepared(request, registry)
    require_writable_runs(request.runs)
    loaded = planner.loaded
    tracker = Tracker(request.runs, loaded) if loaded.recipe.execution.track else None
    runner: Runner | None = None
    status, code, closing, delivered = "KILLED", INTERRUPTED, "", True
    try:
        with StopRequest() as stop:
            runner = Runner(planner, robot, _display(loaded, console), tracker, stop)
            try:
                runner.run()
                status, code = "FINISHED", DONE
            except PipelineFailed as error:
                status, code = "FAILED", STAGE_FAILED
                closing = f"{error}\nfinished stages are kept; after a remedy:\n{_rest(request, runner)}"
            except Interrupted as error:
                closing = "\n".join(filter(None, (str(error), _resumption(request, runner))))
            finally:
                if tracker is not None:
                    wait = bool(runner.made) and not stop()
                    delivered = tracker.close(status, wait) or not wait
    except KeyboardInterrupt:
        code, closing = INTERRUPTED, _resumption(request, runner)
    if code == DONE and runner is not None:
        print_results(runner.artifacts, console)
    if tracker is not None and not delivered and backlog(request.runs):
        console.print("MLflow has not taken everything yet; the rest is sent in the background", highlight=False)
    if closing:
        Console(stderr=True, soft_wrap=True).print(closing, markup=False, highlight=False)
    return code


def _resumption(request: Request, runner: Runner | None) -> str:
    return f"interrupted; to go on:\n{_rest(request, runner)}"


def _rest(request: Request, runner: Runner | None) -> str:
    """The command that makes what is missing."""
    made = runner.made if runner is not None else []
    return request.command([name for name in request.options.force if name not in made])


def _display(loaded: LoadedRecipe, console: Console) -> Display:
    if console.is_terminal:
        return LiveDisplay(console)
    return PlainDisplay(loaded.recipe.execution.line_interval, console.file)
