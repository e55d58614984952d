"""Games on a controller that the skill was not trained with."""

from dataclasses import replace
from pathlib import Path

from pydantic import ValidationError

from iowbc.control.observation import observation_layout
from iowbc.errors import StageFailed
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.task import Task
from iowbc.robot.description import load_robot
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

OF_CONTROLLER = ("control_frequency", "commands", "references", "action")
"""Parts of `task` that belong to a controller; all others are of the games."""


def on_controller(world: Specification, label: str, own: Task, student: Student, rg: Path | None) -> Specification:
    """The games of a world with another controller. `label`: its name in `skill.eval.controllers`; `own`: the task for
    which its `student` was trained; `rg`: folder of its reference generator.

    Raises StageFailed where the controller has no grasp for a scene of the games, or observes what they do not show.
    """
    where, recipe = f"skill.eval.controllers.{label}", world.recipe
    shown = observation_layout(load_robot(world.robot), recipe.task.observation.observe_object).size
    if student.observation > shown:
        text = f"its student observes {student.observation} numbers, these games show {shown}"
        raise StageFailed(f"{where}: {text}; set task.observation.observe_object in the recipe of the games")
    task, scenes = own.model_dump(include=set(OF_CONTROLLER)), recipe.simulation.scenes.names
    for kind in ("grasps", "loads"):  # those of scenes that only its own recipe has are of no use here
        entries = task["references"][kind].items()
        task["references"][kind] = {scene: entry for scene, entry in entries if scene in scenes}
    try:
        played = Recipe.model_validate(recipe.model_dump() | {"task": recipe.task.model_dump() | task})
    except ValidationError as error:
        reasons = "; ".join(problem["msg"] for problem in error.errors())
        text = f"{where}: cannot act in these games: {reasons}; leave it out, or train one whose recipe has this"
        raise StageFailed(text) from None
    return replace(world, recipe=played, rg=rg)
