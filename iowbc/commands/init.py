"""`iowbc init` and `iowbc schema`: recipes, a robot description and the recipes' schema in the user's own folder."""

import json
import shlex
import shutil
import sys
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from iowbc.commands.printed import shown_path, stdout_console, tell
from iowbc.errors import UsageError
from iowbc.files import replacing
from iowbc.pipeline.store.runs import require_writable
from iowbc.recipe.reading.loading import known_files
from iowbc.recipe.recipe import recipe_schema
from iowbc.robot.description import robot_folder


def init(
    folder: Annotated[Path, Argument(help="Folder to create or to fill.", metavar="DIR")],
    robot: Annotated[str, Option(help="Robot description to copy.")] = "g1",
) -> None:
    """Copy what is not there yet, and print it. Raises `UsageError`, also where a file would be replaced."""
    source = robot_folder(robot)
    origins = {folder / "robots" / source.name: source}
    for path in known_files():
        origins.setdefault(folder / "recipes" / path.name, path)
    links = [str(path) for path in (folder / "robots", folder / "recipes", *origins) if path.is_symlink()]
    if links:
        raise UsageError(f"{', '.join(links)}: a link leads elsewhere; remove it, or name another folder")
    # files copied by an earlier, interrupted call are kept
    same = [target for target, origin in origins.items() if target.exists() and _content(target) == _content(origin)]
    there = [str(target) for target in origins if target.exists() and (target not in same or len(same) == len(origins))]
    if there:
        raise UsageError(f"{', '.join(there)} {'is' if len(there) == 1 else 'are'} there already; name another folder")
    require_writable(folder, "DIR")
    console = stdout_console()
    for target, origin in origins.items():
        if target in same:
            continue
        with replacing(target) as fresh:
            shutil.copytree(origin, fresh) if origin.is_dir() else shutil.copyfile(origin, fresh)
        tell(console, shown_path(target))
    tell(console, f"to begin: cd {shlex.quote(str(folder))}, then `iowbc run quickstart`")


def _content(path: Path) -> dict[str, bytes]:
    """The content of a file, or of all files below a folder, by relative path."""
    files = (file for file in (path, *path.rglob("*")) if file.is_file())
    return {file.relative_to(path).as_posix(): file.read_bytes() for file in files}


def schema(output: Annotated[Path | None, Option(help="Output file (default: print).")] = None) -> None:
    """Write the schema, or print it. Raises `UsageError`."""
    text = json.dumps(recipe_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"--output {output}: cannot be written: {error.strerror}; name another file") from None
