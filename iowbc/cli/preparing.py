"""`init`, `schema` and `doctor`: commands to prepare the first run."""

from pathlib import Path
from typing import Annotated

import typer

from iowbc.cli.options import RunsFolder, console, runs_folder


def init(
    folder: Annotated[Path, typer.Argument(help="Folder to create or to fill.", metavar="DIR")],
    robot: Annotated[str, typer.Option(help="Robot description to copy.")] = "g1",
) -> None:
    """Copy the recipes and a robot description into a folder of your own."""
    from iowbc.commands.init import begin

    begin(folder, robot, console())


def schema(output: Annotated[Path | None, typer.Option(help="Output file (default: print).")] = None) -> None:
    """Write the JSON Schema of recipes, for editors."""
    from iowbc.commands.schema import write_schema

    write_schema(output)


def doctor(runs: RunsFolder = None) -> None:
    """Check versions, binaries, rendering, cores, memory and disk."""
    from iowbc.commands.doctor import examine

    raise typer.Exit(examine(runs_folder(runs), console()))
