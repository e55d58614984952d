"""`iowbc export WHAT --web DIR`: an exported controller as a static web page."""

import os
import shlex
from functools import partial
from pathlib import Path
from typing import Annotated

from rich.filesize import decimal
from typer import Argument, Option

from iowbc.commands import completion, options
from iowbc.commands.lookup import named
from iowbc.commands.printed import shown_path, stdout_console, tell
from iowbc.deploy.exported_folder import CONTRACT
from iowbc.errors import UsageError
from iowbc.pipeline.store.runs import Runs, require_writable
from iowbc.pipeline.store.store import Store


def export(
    word: Annotated[
        str,
        Argument(
            help="Recipe, RECIPE/export, key, or export folder.", metavar="WHAT", autocompletion=completion.artifacts
        ),
    ],
    folder: Annotated[Path, Option("--web", help="Output folder of the web page.", metavar="DIR")],
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Write the web page of an exported controller, and print how to open it. Raises `UsageError`."""
    options.require_extra("train", "iowbc export")
    store = Store(Runs(runs))
    exported = Path(word)
    if not os.path.isfile(exported / CONTRACT):
        made = named(store, word).usable
        if "export" not in made:
            raise UsageError(
                f"{word}: no exported controller; finished: {', '.join(made) or 'none'}; "
                "run a recipe that ends with `export`, or give the folder that it made"
            )
        exported = made["export"].folder
    if folder.is_dir() and any(folder.iterdir()) and not (folder / "scenes.json").is_file():
        raise UsageError(f"--web {folder}: holds other files; give an empty folder, or one that this command has made")
    require_writable(folder, "--web")
    require_writable(store.runs.npm, "--runs")

    from iowbc.web.page import write_page

    say = partial(tell, stdout_console())
    write_page(exported, folder, store.runs.npm, say)
    whole = sum(path.stat().st_size for path in folder.iterdir())
    say(f"{shown_path(folder)} ({decimal(whole)}): copy it to any web server; to look at it here:")
    say(f"python3 -m http.server --bind 127.0.0.1 --directory {shlex.quote(shown_path(folder))} 8000")
