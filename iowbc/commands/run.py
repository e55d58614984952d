"""`iowbc run`: from a recipe file to an exit code, with signals, console and tracking around it."""

import shlex
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.console import Console
from typer import Exit, Option

from iowbc.commands import options
from iowbc.commands.compare import film_joint, write_comparison
from iowbc.commands.printed import stdout_console, tell
from iowbc.commands.process import DONE, INTERRUPTED, STAGE_FAILED, RunEnding, ignoring_broken_outputs
from iowbc.commands.request import Request, in_order, planners
from iowbc.commands.results import main_tables, print_results
from iowbc.errors import Interrupted, PipelineFailed, UsageError
from iowbc.pipeline.console.display import Display, LiveTable, PlainDisplay
from iowbc.pipeline.planner import Planner
from iowbc.pipeline.runner import Runner, run_here
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.stop_request import StopRequest
from iowbc.pipeline.store.runs import Runs, require_writable_runs
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.tracking.tracker import Tracker, backlog, record_figures
from iowbc.recipe.execution import Execution
from iowbc.recipe.reading.loading import LoadedRecipe
from iowbc.report.runs import Run

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.cluster import Cluster

Manner = Literal["usual", "quiet", "verbose"]
"""Amount of a run's output."""


def run(
    recipe: options.RecipeFile,
    overrides: options.Overrides = None,
    until: options.Until = None,
    force: options.Force = None,
    workers: options.Workers = None,
    engine: options.Engine = None,
    address: options.Address = None,
    on_code_change: options.OnCodeChange = "report",
    quiet: options.Quiet = False,
    verbose: Annotated[bool, Option("--verbose", "-v", help="Print one line per progress step.")] = False,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Run a recipe or a study; exits with the code of the run."""
    asked = Options(until, frozenset(force or ()), workers, engine, address, on_code_change)
    request = Request(recipe, overrides or (), Runs(runs), asked)
    manner: Manner = "quiet" if quiet else "verbose" if verbose else "usual"
    with ignoring_broken_outputs():
        raise Exit(run_request(request, stdout_console(), manner))


def run_request(request: Request, console: Console, manner: Manner) -> int:
    """Run a recipe, or the variants of a study in order up to the first that does not end, and compare them; returns
    the exit code. Raises `RecipeError`."""
    ready = planners(request)
    options.require_extra("train", "iowbc run")
    require_engine(ready)
    require_writable_runs(request.runs)
    try:
        with (
            requested_cluster(request.options, ready[0].loaded.recipe.execution) as cluster,
            StopRequest(shown=console.is_terminal and manner == "usual") as stop,
        ):
            if cluster is not None and manner != "quiet":
                console.print(cluster.text, highlight=False)
            done: list[Run] = []
            for planner in ready:
                order = in_order(planner)
                for one in order:
                    if (len(ready) > 1 or len(order) > 1) and manner != "quiet":
                        console.print(f"{one.loaded.recipe.name}:", highlight=False)
                    ending = run_recipe(one, request, console, stop, manner, cluster=cluster)
                    if ending.code != DONE:
                        return ending.code
                recipe = planner.loaded.recipe
                done.append(Run(recipe.name, ending.artifacts, recipe.model_dump(mode="json")))
    except KeyboardInterrupt:
        return INTERRUPTED
    if len(ready) > 1 and request.options.until is None and manner != "quiet":
        compare_variants(request, done, console, ready[0].loaded.recipe.execution.track)
    return DONE


def require_engine(planners: Sequence[Planner]) -> None:
    """Raises `UsageError`, before anything is trained, if an evaluation would run in an engine that is missing."""
    for planner in planners:
        steps = planner.plan() if planner.loaded.recipe.eval.engine == "drake" else ()
        if any(step.stage.name == "eval" and not step.cached for step in steps):
            options.require_extra("drake", "eval.engine: drake")


def compare_variants(request: Request, variants: Sequence[Run], console: Console, track: bool) -> None:
    """Compare the variants of a study, film them side by side, and tell MLflow with `track` where that is new."""
    name, store = Path(request.word).stem, Store(request.runs)
    output = request.runs.compared / name
    before = _report_of(output)
    write_comparison(store, variants, output, request.word)
    film_joint(store, console, variants, output)
    report = _report_of(output)
    if report != before and track:
        files = [path for path in sorted(output.rglob("*")) if path.is_file()]
        record_figures(request.runs, f"compare-{name}", {}, report, files)
    if not request.overrides:  # names stand for runs without them
        tell(console, f"next:\n  {shlex.join(['iowbc', 'report', name, *request.runs.option])}")


def _report_of(folder: Path) -> str:
    """The main tables of a comparison in Markdown, the paired differences, and the metrics that differ."""
    others = [path for path in (folder / "tables" / "differences.md", folder / "metrics.md") if path.is_file()]
    return "\n".join([main_tables([folder]), *(path.read_text(encoding="utf-8") for path in others)])


def requested_cluster(asked: Options, execution: Execution) -> "AbstractContextManager[Cluster | None]":
    """Context manager of the requested cluster; it yields None if stages run here. Raises `UsageError`."""
    if (asked.engine or execution.engine) == "local":
        if asked.address:
            raise UsageError(f"--address {asked.address} is that of a Ray cluster; add --engine ray")
        return nullcontext()
    options.require_extra("cluster", "--engine ray")
    from iowbc.pipeline.cluster.connection import connected

    return connected(asked.address or execution.address, copy=execution.copy_files)


def run_recipe(
    planner: Planner,
    request: Request,
    console: Console,
    stop: StopRequest,
    manner: Manner = "usual",
    within: str | None = None,
    cluster: "Cluster | None" = None,
    errors: Console | None = None,
    workers: int = 0,
) -> RunEnding:
    """Run one recipe.

    within: parent run in MLflow. cluster: where stages run; None: here. errors: console for failures and the command
    to resume; None: standard error. workers: of a stage if neither options nor recipe set them; 0: one per core.
    """
    loaded = planner.loaded
    tracker: Tracker | None = None
    runner: Runner | None = None

    def rest() -> str:
        """The command that runs the missing stages."""
        return request.command([name for name in request.options.force if runner is None or name not in runner.made])

    status, ending, closing, delivered = "KILLED", RunEnding(INTERRUPTED), "", True
    try:
        try:
            tracker = Tracker(request.runs, loaded, within) if loaded.recipe.execution.track else None
            display = _display(loaded, console, lambda: stop.text, manner)
            execute = run_here if cluster is None else cluster.run
            runner = Runner(planner, display, tracker, stop, rest, execute, workers)
            runner.run()
            status, ending = "FINISHED", RunEnding(DONE, artifacts=runner.artifacts)
            if tracker is not None:
                tracker.describe(main_tables(artifact.folder for artifact in runner.artifacts.values()))
        except PipelineFailed as error:
            status, ending = "FAILED", RunEnding(STAGE_FAILED, str(error).splitlines()[0])
            closing = f"{error}\nfinished stages are kept; after a remedy:\n{rest()}"
        except Interrupted as error:
            closing = "\n".join(filter(None, (str(error), f"interrupted; to go on:\n{rest()}")))
        finally:
            if tracker is not None:
                wait = within is None and runner is not None and bool(runner.made) and not stop()
                delivered = tracker.close(status, wait=wait) or not wait
    except KeyboardInterrupt:
        ending, closing = RunEnding(INTERRUPTED), f"interrupted; to go on:\n{rest()}"
    if ending.code == DONE and runner is not None and manner != "quiet":
        print_results(request.runs, loaded.recipe.name, runner.artifacts, console)
    if tracker is not None and not delivered and backlog(request.runs):
        console.print(
            "MLflow has not taken everything yet; the rest is sent in the background, or by the next run",
            highlight=False,
        )
    if closing:
        tell(errors or Console(stderr=True), closing)
    return ending


def _display(loaded: LoadedRecipe, console: Console, stopping: Callable[[], str], manner: Manner) -> Display:
    if manner == "quiet":
        return Display()
    if manner == "usual" and console.is_terminal:
        return LiveTable(console, stopping)
    return PlainDisplay(0.0 if manner == "verbose" else loaded.recipe.execution.line_interval, console.file)
