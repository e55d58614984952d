"""Arguments and options of several commands, and functions that interpret them."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from iowbc.commands import completion
from iowbc.commands.needs import PORT
from iowbc.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from iowbc.pipeline.store.runs import Runs
    from iowbc.pipeline.store.store import Store

PIPE_WIDTH = 160
"""Characters in a line of a table where the output is not a terminal."""
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
RunsFolder = Annotated[
    Path | None,
    typer.Option(
        "--runs", help="Folder of artifacts and tracking data (default: $IOWBC_RUNS or ./runs).", envvar="IOWBC_RUNS"
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
Workers = Annotated[int | None, typer.Option(help="Worker processes (default: all available cores).", min=1)]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show the plan without running it.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
SceneName = Annotated[str, typer.Option("--scene", help="Scene of the recipe.", metavar="SCENE")]
BenchRecipe = Annotated[Path | None, typer.Argument(help="Recipe file (default: built-in values).", metavar="RECIPE")]
BenchWorkers = Annotated[list[int] | None, typer.Option("--workers", help="Worker processes (repeatable).", min=1)]
OnCodeChange = Annotated[
    Literal["report", "rerun"], typer.Option(help="Policy for cached stages whose code has changed.")
]
Web = Annotated[bool, typer.Option("--web", help="Interactive viewer in the browser (no display needed).")]
Port = Annotated[int | None, typer.Option(help="Port of --web (default: 8080).", min=1, max=65535)]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Named = Annotated[
    str,
    typer.Argument(
        help="Recipe (name or file), RECIPE/STAGE, or the first characters of a key.",
        metavar="WHAT",
        autocompletion=completion.artifacts,
    ),
]


def page_port(web: bool, port: int | None) -> int | None:
    """The port of a page; None where there is to be none. Raises UsageError for a port without a page."""
    if port is not None and not web:
        raise UsageError("--port is that of the page that --web serves; give both")
    return port or PORT if web else None


def console() -> "Console":
    from rich.console import Console

    columns = os.environ.get("COLUMNS", "")
    width = int(columns) if columns.isdecimal() and int(columns) > 0 else PIPE_WIDTH
    return Console(width=None if sys.stdout.isatty() else width)


def store_in(folder: Path | None) -> "Store":
    from iowbc.pipeline.store.store import Store

    return Store(runs_folder(folder))


def runs_folder(folder: Path | None) -> "Runs":
    from iowbc.pipeline.store.runs import Runs

    return Runs(folder or Path("runs"))
