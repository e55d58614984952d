"""`iowbc init`: a folder with recipes and a robot to begin from."""

import shutil
from pathlib import Path

from rich.console import Console

from iowbc.commands.results import shown_path
from iowbc.errors import UsageError
from iowbc.pipeline.writability import require_writable
from iowbc.recipe.reading.finding import known_files
from iowbc.robot.description import robot_folder


def begin(folder: Path, robot: str, console: Console) -> None:
    """Copy the recipes and a robot's description to `folder`, and replace nothing there. Raises `UsageError`."""
    try:
        source = robot_folder(robot)
    except FileNotFoundError as error:
        raise UsageError(str(error)) from None
    origins = {folder / "robots" / source.name: source}
    for path in known_files():
        origins.setdefault(folder / "recipes" / path.name, path)
    there = [str(target) for target in origins if target.exists()]
    if there:
        raise UsageError(f"{', '.join(there)} {'is' if len(there) == 1 else 'are'} there already; name another folder")
    require_writable(folder, "DIR")
    for target, origin in origins.items():
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(origin, target) if origin.is_dir() else shutil.copyfile(origin, target)
        console.print(shown_path(target), markup=False, highlight=False, soft_wrap=True)
    console.print(f"to begin: cd {folder}, then `iowbc run quickstart`", highlight=False, soft_wrap=True)
