"""What a recipe asks of its robot, checked before anything runs: names and ranges that only the robot can settle."""

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from iowbc.errors import Problem, RecipeError
from iowbc.pipeline.store.digests import folder_digest
from iowbc.recipe.reading.loading import LoadedRecipe

if TYPE_CHECKING:
    from iowbc.robot.description import Robot


@cache
def _loaded(folder: Path, digest: str) -> "Robot":
    """The robot in a folder, read once while its files stay as they are."""
    from iowbc.robot.description import load_robot

    return load_robot(folder)


def check_against_robot(loaded: LoadedRecipe, folder: Path) -> None:
    """Raises `RecipeError` with all that the robot does not have or cannot reach."""
    from iowbc.reference.ranges import wrong_ranges

    try:
        robot = _loaded(folder, folder_digest(folder))
    except (OSError, ValueError) as error:
        raise RecipeError([Problem(loaded.place("robot"), f"key 'robot' = '{loaded.recipe.robot}': {error}")]) from None
    problems = [
        Problem(loaded.place(path), f"key '{path}': {text}") for path, text in wrong_ranges(robot, loaded.recipe.rg)
    ]
    if problems:
        raise RecipeError(problems)
