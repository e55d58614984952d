"""`iowbc run`: from a recipe file to an exit code, with signals, console and tracking around it."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from rich.console import Console

from iowbc.commands.compare import compare
from iowbc.commands.engine import engine
from iowbc.commands.request import Request, prepared, recipes
from iowbc.commands.results import described, print_results
from iowbc.commands.training import require_training
from iowbc.errors import Interrupted, PipelineFailed
from iowbc.pipeline.console.display import Display, PlainDisplay, SilentDisplay
from iowbc.pipeline.console.live_table import LiveTable
from iowbc.pipeline.planner import Planner
from iowbc.pipeline.runner import Runner
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.stop_request import StopRequest
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.tracking.tracker import Tracker, backlog
from iowbc.pipeline.writability import require_writable_runs
from iowbc.recipe.reading.loading import LoadedRecipe

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.cluster import Cluster

Manner = Literal["usual", "quiet", "verbose"]
"""How much a run prints."""
DONE, STAGE_FAILED, INTERRUPTED = 0, 1, 130
"""Exit codes."""


def run(request: Request, registry: Mapping[str, Stage], console: Console, manner: Manner = "usual") -> int:
    """Run a recipe to its end, a failure or an interruption; returns the exit code. Raises `RecipeError`.

    Of a recipe of recipes each is run, in order, up to the first that does not end; then they are compared.
    """
    loaded = recipes(request)
    ready = [prepared(one, request, registry) for one in loaded]
    require_training("run")
    require_writable_runs(request.runs)
    try:
        with (
            engine(request.options, loaded[0].recipe.execution) as cluster,
            StopRequest(shown=console.is_terminal and manner == "usual") as stop,
        ):
            if cluster is not None and manner != "quiet":
                console.print(cluster.text, highlight=False)
            for planner, robot in ready:
                if len(ready) > 1 and manner != "quiet":
                    console.print(f"{planner.loaded.recipe.name}:", highlight=False)
                code = run_recipe(planner, robot, request, console, stop, manner, cluster=cluster)
                if code != DONE:
                    return code
    except KeyboardInterrupt:
        return INTERRUPTED
    if len(ready) > 1 and request.options.until is None and manner != "quiet":
        output = request.runs.root / "compare" / Path(request.word).stem
        compare(Store(request.runs), console, [one.recipe.name for one in loaded], output)
    return DONE


def run_recipe(
    planner: Planner,
    robot: Path,
    request: Request,
    console: Console,
    stop: StopRequest,
    manner: Manner = "usual",
    within: str | None = None,
    cluster: "Cluster | None" = None,
    errors: Console | None = None,
) -> int:
    """Run one recipe; returns the exit code.

    within: the run of a sweep to which this one belongs in MLflow. cluster: where stages run, here if empty. errors:
    where it is said how a run that did not finish goes on; standard error if empty.
    """
    loaded = planner.loaded
    tracker: Tracker | None = None
    runner: Runner | None = None
    status, code, closing, delivered = "KILLED", INTERRUPTED, "", True
    try:
        try:
            tracker = Tracker(request.runs, loaded, within) if loaded.recipe.execution.track else None
            display = _display(loaded, console, lambda: stop.text, manner)
            runner = Runner(planner, robot, display, tracker, stop, lambda made: _rest(request, made))
            if cluster is not None:
                runner.execute = cluster.run
            runner.run()
            status, code = "FINISHED", DONE
            if tracker is not None:
                tracker.describe(described(runner.artifacts))
        except PipelineFailed as error:
            status, code = "FAILED", STAGE_FAILED
            closing = f"{error}\nfinished stages are kept; after a remedy:\n{_rest(request, _made(runner))}"
        except Interrupted as error:
            closing = "\n".join(filter(None, (str(error), _resumption(request, runner))))
        finally:
            if tracker is not None:
                wait = within is None and bool(_made(runner)) and not stop()
                delivered = tracker.close(status, wait) or not wait
    except KeyboardInterrupt:
        code, closing = INTERRUPTED, _resumption(request, runner)
    if code == DONE and runner is not None and manner != "quiet":
        print_results(request.runs, loaded.recipe.name, runner.artifacts, console, request.word)
    if tracker is not None and not delivered and backlog(request.runs):
        console.print("MLflow has not taken everything yet; the rest is sent in the background", highlight=False)
    if closing:
        told = errors or Console(stderr=True)
        told.print(closing, markup=False, highlight=False, soft_wrap=True)
    return code


def _resumption(request: Request, runner: Runner | None) -> str:
    return f"interrupted; to go on:\n{_rest(request, _made(runner))}"


def _made(runner: Runner | None) -> list[str]:
    return runner.made if runner is not None else []


def _rest(request: Request, made: Sequence[str]) -> str:
    """The command that makes what is missing."""
    return request.command([name for name in request.options.force if name not in made])


def _display(loaded: LoadedRecipe, console: Console, stopping: Callable[[], str], manner: Manner) -> Display:
    if manner == "quiet":
        return SilentDisplay()
    if manner == "verbose":
        return PlainDisplay(0.0, console.file)
    if console.is_terminal:
        return LiveTable(console, stopping)
    return PlainDisplay(loaded.recipe.execution.line_interval, console.file)
