"""The commands. Nothing heavy is imported before a command needs it, so that `iowbc --help` answers at once."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from iowbc.pipeline.layout import Runs

app = typer.Typer(
    help="Train, test and export a whole-body controller of a humanoid robot that carries and pushes heavy objects.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

RecipeFile = Annotated[Path, typer.Argument(help="Recipe, a YAML file.", metavar="RECIPE")]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", help="Change a value of the recipe; repeat for more.", metavar="A.B.C=VALUE"),
]
RunsFolder = Annotated[
    Path | None,
    typer.Option("--runs", help="Folder of artifacts and tracking; IOWBC_RUNS, else ./runs.", envvar="IOWBC_RUNS"),
]
Until = Annotated[str | None, typer.Option(help="Stop after this stage.", metavar="STAGE")]
Force = Annotated[list[str] | None, typer.Option(help="Make this stage anew; repeat for more.", metavar="STAGE")]
Workers = Annotated[int | None, typer.Option(help="Worker processes; all available cores.", min=1)]
OnCodeChange = Annotated[
    Literal["report", "rerun"], typer.Option(help="What to do about a cached stage whose code has changed since.")
]


@app.command()
def run(
    recipe: RecipeFile,
    overrides: Overrides = None,
    until: Until = None,
    force: Force = None,
    workers: Workers = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would run, as `plan` does.")] = False,
    on_code_change: OnCodeChange = "report",
    runs: RunsFolder = None,
) -> None:
    """Run a recipe: make every stage that is not cached, and resume what was interrupted."""
    _run_or_plan(recipe, overrides, until, force, workers, on_code_change, runs, only_plan=dry_run)


@app.command()
def plan(
    recipe: RecipeFile,
    overrides: Overrides = None,
    until: Until = None,
    force: Force = None,
    on_code_change: OnCodeChange = "report",
    runs: RunsFolder = None,
) -> None:
    """Say for each stage whether it is cached or would run, why, and how long it takes."""
    _run_or_plan(recipe, overrides, until, force, None, on_code_change, runs, only_plan=True)


def _run_or_plan(
    recipe: Path,
    overrides: list[str] | None,
    until: str | None,
    force: list[str] | None,
    workers: int | None,
    on_code_change: Literal["report", "rerun"],
    runs: Path | None,
    only_plan: bool,
) -> None:
    from rich.console import Console

    from iowbc.pipeline import session
    from iowbc.pipeline.planning import Options
    from iowbc.stages import registry

    options = Options(until, frozenset(force or ()), on_code_change, workers)
    request = session.Request(recipe, tuple(overrides or ()), _runs(runs), options)
    act = session.plan if only_plan else session.run
    raise typer.Exit(act(request, registry.STAGES, Console()))


def _runs(folder: Path | None) -> "Runs":
    from iowbc.pipeline.layout import Runs

    return Runs(folder or Path("runs"))


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit: 0 done, 1 a stage failed, 2 the recipe or the usage is wrong, 130 interrupted."""
    os.environ.setdefault("MLFLOW_DISABLE_TELEMETRY", "true")
    try:
        app(arguments, prog_name="iowbc")
    except Exception as error:
        from iowbc.recipe.problems import UsageError

        if not isinstance(error, UsageError):
            raise
        print(error, file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
