"""Arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from iowbc.commands import completion
from iowbc.commands.needs import PORT
from iowbc.errors import UsageError

RUNS = Path("runs")
"""Folder of artifacts and tracking data where no other is given."""
RunsFolder = Annotated[
    Path,
    typer.Option(
        "--runs",
        help="Folder of artifacts and tracking data (default: $IOWBC_RUNS or ./runs).",
        envvar="IOWBC_RUNS",
        show_default=False,
    ),
]
RecipeFile = Annotated[
    str, typer.Argument(help="Recipe: a YAML file or its name.", metavar="RECIPE", autocompletion=completion.recipes)
]
Overrides = Annotated[
    list[str] | None,
    typer.Option(
        "--set", help="Override a recipe value (repeatable).", metavar="A.B.C=VALUE", autocompletion=completion.paths
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
    str | None, typer.Option(help="Ray cluster: local, auto, HOST:PORT, ray://HOST:PORT.", metavar="ADDRESS")
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Show the plan without running it.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]
OnCodeChange = Annotated[
    Literal["report", "rerun"], typer.Option(help="Policy for cached stages whose code has changed.")
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
