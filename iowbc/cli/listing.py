"""`status`, `ls`, `show`, `diff`, `compare`, `report`, `ui` and `gc`: list, compare and remove runs and artifacts."""

from pathlib import Path
from typing import Annotated

import typer

from iowbc.cli.options import AsJson, Named, RunsFolder, console, runs_folder, store_in
from iowbc.commands import completion


def status(as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show running and unfinished stages, and the artifacts of each recipe."""
    from iowbc.commands.listing import print_status

    print_status(store_in(runs), console(), as_json)


def list_(
    stage: Annotated[
        str | None, typer.Argument(help="Only artifacts of this stage.", autocompletion=completion.stages)
    ] = None,
    as_json: AsJson = False,
    runs: RunsFolder = None,
) -> None:
    """List the stored artifacts."""
    from iowbc.commands.listing import list_artifacts

    list_artifacts(store_in(runs), console(), stage, as_json)


def show(what: Named, as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show an artifact in detail, or the stages and metrics of a recipe."""
    from iowbc.commands.listing import show as print_artifact

    print_artifact(store_in(runs), console(), what, as_json)


def gc(
    unused: Annotated[bool, typer.Option("--unused", help="Remove artifacts that no recipe uses.")] = False,
    recipe: Annotated[
        list[str] | None, typer.Option(help="Remove this recipe's record and the artifacts that only it uses.")
    ] = None,
    work: Annotated[bool, typer.Option("--work", help="Remove checkpoints of unfinished stages.")] = False,
    damaged: Annotated[bool, typer.Option("--damaged", help="Remove artifacts set aside as damaged.")] = False,
    older_than: Annotated[float, typer.Option(help="Minimum age of removed items.", min=0.0, metavar="DAYS")] = 0.0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="List the removals without removing anything.")] = False,
    runs: RunsFolder = None,
) -> None:
    """Remove artifacts and checkpoints, selected by at least one option."""
    from iowbc.commands.gc import Scope, collect

    scope = Scope(unused, tuple(recipe or ()), work, damaged, older_than)
    collect(store_in(runs), console(), scope, dry_run)


def diff(first: Named, second: Named, as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show how two recipes or artifacts differ: recipe, keys, versions, code, metrics."""
    from iowbc.commands.diff import diff as print_differences

    print_differences(store_in(runs), console(), first, second, as_json)


def compare(
    recipes: Annotated[
        list[str],
        typer.Argument(
            help="Two or more finished recipes, or a study.",
            metavar="RECIPE...",
            autocompletion=completion.ran,
        ),
    ],
    output: Annotated[Path | None, typer.Option(help="Output folder (default: runs/compare).")] = None,
    film: Annotated[
        bool, typer.Option("--film", help="Also record a film of one trial, all recipes side by side.")
    ] = False,
    as_json: AsJson = False,
    runs: RunsFolder = None,
) -> None:
    """Compare several runs in tables and figures."""
    from iowbc.commands.compare import compare as write_comparison

    write_comparison(store_in(runs), console(), recipes, output, film, as_json)


def report(
    recipes: Annotated[
        list[str],
        typer.Argument(help="One or more finished recipes.", metavar="RECIPE...", autocompletion=completion.ran),
    ],
    output: Annotated[Path | None, typer.Option(help="Output HTML file (default: runs/report/RECIPE.html).")] = None,
    log: Annotated[
        Path | None,
        typer.Option(help="Replay and plot this log of `iowbc robot RECIPE` instead (default output: MCAP.png)."),
    ] = None,
    runs: RunsFolder = None,
) -> None:
    """Write one HTML page about runs: tables, interactive curves, films, differences; readable offline."""
    from iowbc.commands.compare import report as write_report

    if log is not None:
        from iowbc.commands.robot_log import report_log

        report_log(console(), recipes[0], log, output or log.with_suffix(".png"))
        return
    store = store_in(runs)
    name = "-".join(Path(recipe).stem for recipe in recipes)
    write_report(store, console(), recipes, output or store.runs.reports / f"{name}.html")


def ui(
    port: Annotated[int, typer.Option(help="Local port.", min=1, max=65535)] = 5000, runs: RunsFolder = None
) -> None:
    """Open MLflow's web interface for the runs, on this machine only."""
    from iowbc.commands.ui import serve

    raise typer.Exit(serve(runs_folder(runs), console(), port))
