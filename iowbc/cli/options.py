"""Arguments and options of several commands, and functions that interpret them."""

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
RunsFolder = Annotated[
    Path | None,
    typer.Option(
        "--runs", help="Folder of artifacts and tracking data (default: $IOWBC_RUNS or ./runs).", envvar="IOWBC_RUNS"
    ),
]
Web = Annotated[bool, typer.Option("--web", help="Interactive viewer in the browser (no display needed).")]
Port = Annotated[int | None, typer.Option(help="Port of --web (default: 8080).", min=1, max=65535)]
SceneName = Annotated[str, typer.Option("--scene", help="Scene of the recipe.", metavar="SCENE")]
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
