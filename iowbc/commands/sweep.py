"""`iowbc sweep`: runs a recipe with every combination of given values, and reports the results."""

import math
import shlex
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
from rich.console import Console
from typer import Exit, Option

from iowbc.commands import completion, options
from iowbc.commands.lookup import SWEEP_POINTS, SWEEP_TABLE, named, record_sweep
from iowbc.commands.plan import in_all, plan_table, planned
from iowbc.commands.points import Endings, PointProcess, PointRun, PointThread, run_points
from iowbc.commands.printed import shown_path, stdout_console, tell
from iowbc.commands.process import DONE, INTERRUPTED, STAGE_FAILED, RunEnding, ignoring_broken_outputs
from iowbc.commands.request import Request, in_order, prepared
from iowbc.commands.results import headline
from iowbc.commands.run import requested_cluster, require_engine, run_recipe
from iowbc.errors import UsageError
from iowbc.pipeline.console.board import Board
from iowbc.pipeline.planner import Planner
from iowbc.pipeline.stage_plan import Options
from iowbc.pipeline.stop_request import StopRequest
from iowbc.pipeline.store.runs import Runs, require_writable_runs
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.tracking.tracker import RunRecord, sweep_record
from iowbc.processes import available_cores
from iowbc.recipe.recipe import PIPELINE, SEEDS
from iowbc.recipe.sweep import MOST_POINTS, Sweep, load_sweep, written
from iowbc.report.runs import Run
from iowbc.results.table import Cell, Table, drawn, heads, markdown, measured

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.cluster import Cluster

LOGS = "logs"
"""Folder of a sweep with what each point prints."""
OUTCOMES_SHOWN = 6
"""Maximum number of metrics in the table of results; those of the last stages come first."""


def sweep(
    recipe: options.RecipeFile,
    overrides: Annotated[
        list[str] | None,
        Option(
            "--set",
            help="Value to set, or values to vary (a,b or 0..4; repeat for a grid).",
            metavar="A.B.C=VALUES",
            autocompletion=completion.paths,
        ),
    ] = None,
    file: Annotated[
        Path | None, Option("--from", help="YAML file of a sweep: grid, random draws, or both.", metavar="YAML")
    ] = None,
    jobs: Annotated[
        int | None,
        Option(help="Points run in parallel on shared cores (default: 1; with Ray: all cores).", min=1),
    ] = None,
    points: Annotated[int, Option(help="Maximum number of points.", min=1)] = MOST_POINTS,
    until: options.Until = None,
    workers: Annotated[int | None, Option(help="Worker processes per point.", min=1)] = None,
    engine: options.Engine = None,
    address: options.Address = None,
    dry_run: Annotated[bool, Option("--dry-run", help="Show the plan without running it.")] = False,
    on_code_change: options.OnCodeChange = "report",
    quiet: options.Quiet = False,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Run a sweep, or print its plan; exits with the code of the run."""
    settings = Options(until, frozenset(), workers, engine, address, on_code_change)
    further = ["--from", str(file)] if file else []
    further += ["--jobs", str(jobs)] if jobs else []
    further += ["--points", str(points)] if points != MOST_POINTS else []
    request = Request(recipe, overrides or (), Runs(runs), settings, "sweep", further)
    console = stdout_console()
    found = load_sweep(recipe, request.overrides, file, points)
    planners = [prepared(point.loaded, request.runs, settings) for point in found.points]
    if dry_run:
        plans = planned(planners)
        console.print(plan_table(plans, "point"))
        console.print(in_all(plans), highlight=False)
        return
    with ignoring_broken_outputs():
        raise Exit(run_sweep(request, found, planners, jobs, console, quiet))


def _require_origins(asked: Request, planners: Sequence[Planner]) -> None:
    """Raises `UsageError` where points begin from what another recipe has not made yet: they would all wait for it."""
    missing = [origin for one in planners for origin in in_order(one)[:-1]]
    first = [
        Request(str(one.loaded.file), (), asked.runs, one.options).command([one.stages[-1].name] if one.whole else ())
        for one in missing
    ]
    if first:
        lines = "\n  ".join(dict.fromkeys(first))
        raise UsageError(f"the points begin from what is not made yet; first\n  {lines}")


def run_sweep(
    asked: Request, found: Sweep, planners: Sequence[Planner], jobs: int | None, console: Console, quiet: bool
) -> int:
    """Run all points, even if some fail; returns the exit code. Raises `UsageError` if another recipe has to run first.
    planners: of the points; jobs: see `_shared_out`."""
    _require_origins(asked, planners)
    runs, execution = asked.runs, planners[0].loaded.recipe.execution
    options.require_extra("train", "iowbc sweep")
    require_engine(planners)
    require_writable_runs(runs)
    folder = runs.sweeps / found.name
    before, said = planned(planners), Console(quiet=True) if quiet else console
    said.print(f"{found.name}: {in_all(before)}", highlight=False, soft_wrap=True)
    endings: Endings = dict.fromkeys(before, RunEnding(INTERRUPTED))
    record: RunRecord | None = None
    try:
        with (
            requested_cluster(asked.options, execution) as cluster,
            StopRequest(shown=console.is_terminal and not quiet) as stop,
        ):
            if cluster is not None:
                said.print(cluster.text, highlight=False)
            record_sweep(found, folder)
            jobs, workers = _shared_out(planners, jobs, cluster)
            if execution.track and not all(step.cached for own in before.values() for step in own):
                record = sweep_record(runs, found, execution)
                record.send()
            origin = None if record is None else record.origin
            tasks = []
            for planner in planners:
                loaded = planner.loaded
                request = Request(str(loaded.file), loaded.overrides, runs, asked.options)
                run = partial(run_recipe, planner, request, stop=stop, within=origin, cluster=cluster, workers=workers)
                tasks.append(PointRun(loaded.recipe.name, folder / LOGS / f"{loaded.recipe.name}.log", run))
            logs = {task.name: task.log for task in tasks}
            start = PointProcess if cluster is None else lambda task: PointThread(task, cluster.abort)
            board = Board(console, logs, execution.line_interval, quiet, lambda: stop.text)
            with board.live or nullcontext():
                endings = run_points(tasks, jobs, stop, board, start)
    except KeyboardInterrupt:
        pass  # recorded in the endings
    states = {ending.state for ending in endings.values()}
    code = INTERRUPTED if states & {"stopped", "waits"} else STAGE_FAILED if "failed" in states else DONE
    try:
        if code != INTERRUPTED:
            _conclude(found, endings, runs, folder, said, record)
    finally:
        if record is not None:
            status = {DONE: "FINISHED", STAGE_FAILED: "FAILED"}.get(code, "KILLED")
            record.close(status, wait=status != "KILLED")
    _tell_rest(asked, endings, folder, code)
    return code


def _shared_out(planners: Sequence[Planner], jobs: int | None, cluster: "Cluster | None") -> tuple[int, int]:
    """Points that run in parallel, by default one or what a cluster's cores allow, and worker processes of each."""
    cores = available_cores() if cluster is None else cluster.cores
    actors = max(one.loaded.recipe.execution.rollout_actors or 1 for one in planners)
    jobs = jobs or (1 if cluster is None else max(1, min(cores // actors, len(planners))))
    most = cores if cluster is None else cluster.largest
    return jobs, max(1, min(most, cores // jobs))


def _conclude(
    found: Sweep, endings: Endings, runs: Runs, folder: Path, console: Console, record: RunRecord | None
) -> None:
    """Write the results of the points that have finished, print them, and record them."""
    import pandas as pd

    states = {name: ending.state for name, ending in endings.items()}
    finished = {name: named(Store(runs), name) for name, state in states.items() if state == "done"}
    if not finished:
        return
    results, means = results_of(found, finished)
    paths = [folder / name for name in (SWEEP_TABLE, SWEEP_POINTS)]
    paths[0].write_text(markdown(results), encoding="utf-8")
    rows = []
    for point in found.points:
        rows.append({"point": point.name, "state": states.get(point.name, "waits"), **point.settings})
        for stage, artifact in finished[point.name].artifacts.items() if point.name in finished else ():
            rows[-1] |= {f"{stage}/{name}": value for name, value in artifact.metrics.items()}
    pd.DataFrame(rows).to_csv(paths[1], index=False)
    if record is not None:
        record.describe(markdown(results), means, [paths[0]])
    console.print(drawn(results, console.width))
    for path in paths:
        tell(console, shown_path(path))
    if len(finished) > 1:
        tell(console, f"next:\n  {shlex.join(['iowbc', 'compare', found.name, *runs.option])}")


def results_of(sweep: Sweep, found: Mapping[str, Run]) -> tuple[Table, dict[str, float]]:
    """A row for each setting: means over seeds with half their 95 % interval; and these means by setting and metric.
    `found`: the finished points by name, at least one."""
    settings = [path for path in sweep.axes if path not in SEEDS]
    last_words = [path.rpartition(".")[2] for path in settings]
    names = [word if last_words.count(word) == 1 else path for word, path in zip(last_words, settings, strict=True)]
    finished = [point for point in sweep.points if point.name in found]
    groups: dict[tuple[str, ...], list[Run]] = {}
    for point in finished:
        groups.setdefault(tuple(written(point.settings[path]) for path in settings), []).append(found[point.name])
    metrics = _chosen([found[point.name] for point in finished])
    rows, means = list[tuple[Cell, ...]](), dict[str, float]()
    for values, runs in groups.items():
        label = ", ".join(map(" ".join, zip(names, values, strict=True))) or sweep.name
        figures = {f"{stage} {name}": _mean(runs, stage, name) for stage, name in metrics}
        means |= {f"{label}/{name}": mean for name, (mean, _) in figures.items() if math.isfinite(mean)}
        cells = [measured(mean, half, ".4g", ".2g", none="") for mean, half in figures.values()]
        rows.append((*values, str(len(runs)), *cells))
    columns = heads(*names, "seeds", *(f"{stage} {name}" for stage, name in metrics))
    caption = f"Sweep {sweep.name}: means over seeds with their 95 % interval."
    return Table(sweep.name, caption, columns, rows, grouped=False), means


def _chosen(runs: Sequence[Run]) -> Sequence[tuple[str, str]]:
    """Stage and name of the main metrics in which points differ, of many those of the last stages; if none differs,
    those of the last stage."""
    found = (
        (stage, name)
        for stage in reversed(PIPELINE)
        for run in runs
        if stage in run.artifacts
        for name, _ in headline(stage, run.artifacts[stage].metrics)
    )
    known = list(dict.fromkeys(found))
    differing = [metric for metric in known if len({_metric(run, *metric) for run in runs}) > 1]
    last = [metric for metric in known if metric[0] == known[0][0]]
    return (differing or last)[:OUTCOMES_SHOWN][::-1]


def _mean(runs: Sequence[Run], stage: str, name: str) -> tuple[float, float]:
    """Mean of a metric and half its interval, NaN where there is none; runs that share an artifact count as one
    measurement."""
    from iowbc.evaluation.report.statistics import mean_half_width

    once = {run.artifacts[stage].manifest.key: _metric(run, stage, name) for run in runs if stage in run.artifacts}
    values = np.array([value for value in once.values() if math.isfinite(value)], np.float64)
    if not len(values):
        return math.nan, math.nan
    alike = len(values) > 1 and not np.ptp(values)
    return float(values.mean()), 0.0 if alike else mean_half_width(values)


def _metric(run: Run, stage: str, name: str) -> float:
    """A metric of a run; NaN where it has none."""
    return run.artifacts[stage].metrics.get(name, math.nan) if stage in run.artifacts else math.nan


def _tell_rest(asked: Request, endings: Endings, folder: Path, code: int) -> None:
    """Print failures and the command to resume on standard error."""
    said = Console(stderr=True, soft_wrap=True)
    failed = {name: ending.failure for name, ending in endings.items() if ending.state == "failed"}
    if failed:
        said.print(f"{len(failed)} of {len(endings)} points failed:", highlight=False)
    for name, failure in failed.items():
        log = folder / LOGS / f"{name}.log"
        said.print(f"  {name}: {failure} (log {shown_path(log)})", markup=False, highlight=False)
    if code != DONE:
        head = "interrupted; to go on:" if code == INTERRUPTED else "what is finished is kept; after a remedy:"
        said.print(f"{head}\n{asked.command()}", markup=False, highlight=False)
