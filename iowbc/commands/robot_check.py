"""What a recipe asks of its robot, checked before anything runs: names and ranges that only the robot can settle."""

from pathlib import Path

from iowbc.errors import Problem, RecipeError
from iowbc.recipe.reading.loading import LoadedRecipe


def check_against_robot(loaded: LoadedRecipe, folder: Path) -> None:
    """Raises `RecipeError` with all that the robot does not have or cannot reach."""
    from iowbc.reference.ranges import wrong_ranges
    from iowbc.robot.description import load_robot

    try:
        robot = load_robot(folder)
    except (OSError, ValueError) as error:
        raise RecipeError([Problem(loaded.place("robot"), f"key 'robot' = '{loaded.recipe.robot}': {error}")]) from None
    problems = [
        Problem(loaded.place(path), f"key '{path}': {text}") for path, text in wrong_ranges(robot, loaded.recipe.rg)
    ]
    if problems:
        raise RecipeError(problems)
