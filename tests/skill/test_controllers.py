"""Games on a controller that the skill was not trained with."""

from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changes import with_changes

from iowbc.control.observation import observation_layout
from iowbc.errors import StageFailed
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import load_robot
from iowbc.skill.episodes import Plan
from iowbc.skill.evaluation.games import on_controller
from iowbc.skill.game import TransportGame
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

BLIND = {"task.observation.observe_object": False}


def test_a_controller_brings_what_is_its_own_and_leaves_the_world(
    world: Specification, student: Student, tmp_path: Path
) -> None:
    changes = {"task.references.gait.frequency": 1.1, "task.action.bound": 2.0, "task.termination.torso_roll": 0.1}
    own = with_changes(world.recipe, changes).task
    played = on_controller(world, "other", own, student, tmp_path)
    assert (played.recipe.task.references, played.recipe.task.action) == (own.references, own.action)
    assert played.recipe.task.termination == world.recipe.task.termination
    assert (played.recipe.simulation, played.recipe.skill) == (world.recipe.simulation, world.recipe.skill)
    assert played.rg == tmp_path


def test_the_skill_sees_the_object_above_a_student_that_does_not(world: Specification) -> None:
    size, seen = observation_layout(load_robot(world.robot), False).size, []

    def still(history: Any) -> Any:
        seen.append(history.shape[-1])
        return np.zeros((*history.shape[:-2], 15), np.float32)

    blind = Student(still, 3, size)  # type: ignore[arg-type]
    played = on_controller(world, "WBC", with_changes(world.recipe, BLIND).task, blind, None)
    robots = []
    for specification in (world, played):
        plans = [Plan("lift_straight", "path", known=False, seed=1)]
        with closing(TransportGame(specification, blind, n=1, plans=plans)) as game:
            robots.append(game.reset().observations["robot"])
            game.step({name: np.zeros((1, n), np.float32) for name, n in game.action_sizes.items()})
    np.testing.assert_array_equal(*robots)
    assert np.abs(robots[0]).max() > 0.1
    assert set(seen) == {size}


def test_what_a_controller_lacks_is_named_and_what_it_has_beyond_the_games_is_left_out(
    world: Specification, student: Student
) -> None:
    unseen = Specification(with_changes(world.recipe, BLIND), world.robot)
    with pytest.raises(StageFailed, match=r"controllers\.other: its student observes \d+ numbers, these games show"):
        on_controller(unseen, "other", world.recipe.task, student, None)
    values = world.recipe.model_dump()
    values["simulation"]["scenes"]["barrel"] = values["simulation"]["scenes"]["lift"]
    values["task"]["references"]["grasps"]["barrel"] = (0.3, 0.16, 0.26)
    values["task"]["references"]["loads"]["barrel"] = 3.0
    further = Specification(Recipe.model_validate(values), world.robot)
    with pytest.raises(StageFailed, match=r"other: cannot act in these games: .*barrel: has no base grasp"):
        on_controller(further, "other", world.recipe.task, student, None)
    played = on_controller(world, "other", further.recipe.task, student, None)
    assert played.recipe.task.references == world.recipe.task.references
