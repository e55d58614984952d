"""`run`, `sweep`, `plan` and `publish`: make, plan and publish a recipe's artifacts."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from iowbc.cli.options import AsJson, RunsFolder, console
from iowbc.commands import completion
from iowbc.commands.process import outlasting_readers

if TYPE_CHECKING:
    from iowbc.commands.request import Request

RecipeFile = Annotated[
    str,
    typer.Argument(help="Recipe: a YAML file or its name.", metavar="RECIPE", autocompletion=completion.recipes),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        help="Override a recipe value (repeatable).",
        metavar="A.B.C=VALUE",
        autocompletion=completion.paths,
    ),
]
SweepFile = Annotated[
    Path | None, typer.Option("--from", help="YAML file of a sweep: grid, random draws, or both.", metavar="YAML")
]
Until = Annotated[
    str | None, typer.Option(help="Stop after this stage.", metavar="STAGE", autocompletion=completion.stages)
]
Force = Annotated[
    list[str] | None,
    typer.Option(
        help="Re-run this stage even if it is cached (repeatable).", metavar="STAGE", autocompletion=completion.stages
    ),
]
Engine = Annotated[
    Literal["local", "ray"] | None, typer.Option(help="Execution engine: local processes or a Ray cluster.")
]
Address = Annotated[
    str | None,
    typer.Option(help="Ray cluster: local, auto, HOST:PORT, ray://HOST:PORT.", metavar="ADDRESS"),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show the plan without running it.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
OnCodeChange = Annotated[
    Literal["report", "rerun"], typer.Option(help="Policy for cached stages whose code has changed.")
]


def run(
    recipe: RecipeFile,
    overrides: Overrides = None,
    until: Until = None,
    force: Force = None,
    workers: Annotated[int | None, typer.Option(help="Worker processes (default: all available cores).", min=1)] = None,
    engine: Engine = None,
    address: Address = None,
    dry_run: DryRun = False,
    on_code_change: OnCodeChange = "report",
    quiet: Quiet = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Print one line per progress step.")] = False,
    runs: RunsFolder = None,
) -> None:
    """Run a recipe: run every stage that is not cached, and resume interrupted ones."""
    from iowbc.commands.plan import plan as print_plan
    from iowbc.commands.run import run as run_recipe

    options: dict[str, Any] = {"workers": workers, "engine": engine, "address": address}
    request = request_of(recipe, overrides, runs, force, until=until, on_code_change=on_code_change, **options)
    if dry_run:
        print_plan(request, console())
        return
    with outlasting_readers():
        raise typer.Exit(run_recipe(request, console(), "quiet" if quiet else "verbose" if verbose else "usual"))


def sweep(
    recipe: RecipeFile,
    overrides: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="Value to set, or values to vary (a,b or 0..4; repeat for a grid).",
            metavar="A.B.C=VALUES",
            autocompletion=completion.paths,
        ),
    ] = None,
    file: SweepFile = None,
    jobs: Annotated[
        int | None,
        typer.Option(help="Points run in parallel on shared cores (default: 1; with Ray: all cores).", min=1),
    ] = None,
    points: Annotated[int, typer.Option(help="Maximum number of points.", min=1)] = 1_000,
    until: Until = None,
    workers: Annotated[int | None, typer.Option(help="Worker processes per point.", min=1)] = None,
    engine: Engine = None,
    address: Address = None,
    dry_run: DryRun = False,
    on_code_change: OnCodeChange = "report",
    quiet: Quiet = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON (with --dry-run).")] = False,
    runs: RunsFolder = None,
) -> None:
    """Run a recipe with every combination of given values; shared stages run once."""
    from iowbc.commands.sweep import SweepRequest, plan_sweep
    from iowbc.commands.sweep import sweep as run_sweep

    options: dict[str, Any] = {"workers": workers, "engine": engine, "address": address}
    request = request_of(recipe, overrides, runs, until=until, on_code_change=on_code_change, **options)
    asked = SweepRequest(request, file, jobs, points)
    if dry_run:
        plan_sweep(asked, console(), as_json)
    else:
        with outlasting_readers():
            raise typer.Exit(run_sweep(asked, console(), quiet))


def plan(
    recipe: RecipeFile,
    overrides: Overrides = None,
    until: Until = None,
    force: Force = None,
    on_code_change: OnCodeChange = "report",
    as_sweep: Annotated[bool, typer.Option("--sweep", help="Plan a sweep: `--set` accepts several values.")] = False,
    file: SweepFile = None,
    as_json: AsJson = False,
    runs: RunsFolder = None,
) -> None:
    """Show whether each stage is cached or would run, the reason, and the expected time."""
    from iowbc.commands.plan import plan as print_plan
    from iowbc.commands.sweep import SweepRequest, plan_sweep

    request = request_of(recipe, overrides, runs, force, until=until, on_code_change=on_code_change)
    if as_sweep or file is not None:
        plan_sweep(SweepRequest(request, file, None), console(), as_json)
    else:
        print_plan(request, console(), as_json)


def publish(
    recipe: RecipeFile,
    overrides: Overrides = None,
    until: Until = None,
    without: Annotated[
        list[str] | None,
        typer.Option(
            help="File to leave out (repeatable); state.safetensors is needed only to extend a training.",
            metavar="FILE",
        ),
    ] = None,
    runs: RunsFolder = None,
) -> None:
    """Copy a recipe's finished artifacts to the repository (runs/published), where a fresh clone finds them."""
    from iowbc.commands.publish import publish_recipe

    publish_recipe(request_of(recipe, overrides, runs, until=until), console(), without or ())


def request_of(
    recipe: str, overrides: list[str] | None, runs: Path | None, force: list[str] | None = None, **options: Any
) -> "Request":
    from iowbc.commands.request import Request
    from iowbc.pipeline.stage_plan import Options
    from iowbc.pipeline.store.runs import Runs

    asked = Options(force=frozenset(force or ()), **options)
    return Request(recipe, tuple(overrides or ()), Runs(runs or Path("runs")), asked)
