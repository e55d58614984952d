"""`diff`, `compare`, `report` and `ui`: runs beside one another."""

from pathlib import Path
from typing import Annotated

import typer

from iowbc.cli.options import AsJson, Named, RunsFolder, console, runs_folder, store_in
from iowbc.commands import completion


def diff(first: Named, second: Named, as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show how two recipes or artifacts differ: recipe, keys, versions, code, metrics."""
    from iowbc.commands.diff import diff as print_differences

    print_differences(store_in(runs), console(), first, second, as_json)


def compare(
    recipes: Annotated[
        list[str],
        typer.Argument(
            help="Finished recipes, two or more, or a study.",
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
    """Write tables and figures over several runs."""
    from iowbc.commands.compare import compare as write_comparison

    store = store_in(runs)
    write_comparison(store, console(), recipes, output, film, as_json)


def report(
    recipes: Annotated[
        list[str],
        typer.Argument(help="Finished recipes, one or more.", metavar="RECIPE...", autocompletion=completion.ran),
    ],
    output: Annotated[Path | None, typer.Option(help="Output HTML file (default: runs/report/RECIPE.html).")] = None,
    log: Annotated[
        Path | None,
        typer.Option(help="Replay and draw this log of `iowbc robot RECIPE` instead (default output: MCAP.png)."),
    ] = None,
    runs: RunsFolder = None,
) -> None:
    """Write one HTML page about runs: tables, interactive curves, films, differences; it opens without a network."""
    from iowbc.commands.report import report as write_report

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
    """Open MLflow's web interface on the runs, for this machine alone."""
    from iowbc.commands.ui import serve

    raise typer.Exit(serve(runs_folder(runs), console(), port))
