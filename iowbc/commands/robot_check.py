"""What a recipe asks of its robot, checked before anything runs: names and ranges that only the robot can settle."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from iowbc.errors import Problem, RecipeError, nearest
from iowbc.recipe.generator import Sampling
from iowbc.recipe.reading.loading import LoadedRecipe

if TYPE_CHECKING:
    from iowbc.robot.description import Robot

PLAUSIBLE_HEIGHT = (0.3, 1.25)
"""Heights that can be commanded at all, in heights of the default posture: a slip of unit or digit lies outside."""
USUAL = Sampling()


def check_against_robot(loaded: LoadedRecipe, folder: Path) -> None:
    """Raises `RecipeError` with all that the robot does not have or cannot reach; reads it only where that is asked."""
    sampling = loaded.recipe.rg.sampling
    if not sampling.joint_ranges and sampling.height == USUAL.height:
        return
    from iowbc.robot.description import load_robot

    try:
        robot = load_robot(folder)
    except (OSError, ValueError) as error:
        raise RecipeError([Problem(loaded.place("robot"), f"key 'robot' = '{loaded.recipe.robot}': {error}")]) from None
    problems = [*_joint_ranges(loaded, robot), *_height(loaded, robot)]
    if problems:
        raise RecipeError(problems)


def _joint_ranges(loaded: LoadedRecipe, robot: "Robot") -> Iterator[Problem]:
    arms = {robot.joints[index]: index for index in robot.interaction}
    for name, asked in loaded.recipe.rg.sampling.joint_ranges.items():
        path = f"rg.sampling.joint_ranges.{name}"
        place = loaded.place(path)
        if name not in arms:
            reason = "is no arm joint" if name in robot.joints else "is no joint"
            text = f"key '{path}': {reason} of {robot.name}; valid: {', '.join(arms)}{nearest(name, arms)}"
            yield Problem(place, text)
            continue
        lower, upper = float(robot.lower[arms[name]]), float(robot.upper[arms[name]])
        if asked.low < lower or asked.high > upper:
            text = (
                f"key '{path}' = {asked.low:g} to {asked.high:g}: the joint's limits are {lower:.4g} to {upper:.4g} rad"
            )
            yield Problem(place, text)


def _height(loaded: LoadedRecipe, robot: "Robot") -> Iterator[Problem]:
    asked = loaded.recipe.rg.sampling.height
    lower, upper = (factor * robot.default_height for factor in PLAUSIBLE_HEIGHT)
    if asked.low < lower or asked.high > upper:
        text = (
            f"key 'rg.sampling.height' = {asked.low:g} to {asked.high:g}: the pelvis of {robot.name} "
            f"stands {robot.default_height:.3g} m high; valid: {lower:.2g} to {upper:.2g} m"
        )
        yield Problem(loaded.place("rg.sampling.height"), text)
