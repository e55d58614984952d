"""`status`, `ls`, `show` and `gc`: what the folder of runs holds."""

from typing import Annotated

import typer

from iowbc.cli.options import AsJson, Named, RunsFolder, console, store_in
from iowbc.commands import completion


def status(as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show what runs, what was left unfinished, and what each recipe has."""
    from iowbc.commands.status import print_status

    print_status(store_in(runs), console(), as_json)


def list_(
    stage: Annotated[
        str | None, typer.Argument(help="Only artifacts of this stage.", autocompletion=completion.stages)
    ] = None,
    as_json: AsJson = False,
    runs: RunsFolder = None,
) -> None:
    """List the stored artifacts."""
    from iowbc.commands.ls import list_artifacts

    list_artifacts(store_in(runs), console(), stage, as_json)


def show(what: Named, as_json: AsJson = False, runs: RunsFolder = None) -> None:
    """Show an artifact in detail, or the stages and metrics of a recipe."""
    from iowbc.commands.show import show as print_artifact

    print_artifact(store_in(runs), console(), what, as_json)


def gc(
    unused: Annotated[bool, typer.Option("--unused", help="Remove artifacts that no recipe uses.")] = False,
    recipe: Annotated[
        list[str] | None, typer.Option(help="Remove this recipe's record and the artifacts used by it alone.")
    ] = None,
    work: Annotated[bool, typer.Option("--work", help="Remove checkpoints of unfinished stages.")] = False,
    damaged: Annotated[bool, typer.Option("--damaged", help="Remove artifacts set aside as damaged.")] = False,
    older_than: Annotated[float, typer.Option(help="Minimum age of what is removed.", min=0.0, metavar="DAYS")] = 0.0,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="List what would be removed, remove nothing.")] = False,
    runs: RunsFolder = None,
) -> None:
    """Remove artifacts and checkpoints; refuses without a scope."""
    from iowbc.commands.gc import Scope, collect

    scope = Scope(unused, tuple(recipe or ()), work, damaged, older_than)
    collect(store_in(runs), console(), scope, dry_run)
