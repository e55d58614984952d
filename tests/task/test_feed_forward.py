"""What the arms expect to carry: the same in training and in trials, where a baseline is to be fair."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changes import with_changes

from iowbc.evaluation.trials.plan import UNDISTURBED, command_script, planned_episode
from iowbc.evaluation.trials.protocol import evaluated_world
from iowbc.recipe.evaluation.sequences import STANDING
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

RECIPES = Path(__file__).parents[2] / "recipes"
PLAYED_AS = {"lift_arms": ("lift", "squeeze"), "tyre_arms": ("tyre",), "push_arms": ("push",)}
"""Scenes of the trials by the scene in which the same posture of the arms was trained."""


def arm_targets(recipe: Recipe, folder: Path, robot: Robot, scene: str) -> Any:
    """Targets of the arms' joint controllers at the start of a trial in a scene, (14,) [rad]."""
    script = command_script(STANDING, recipe.task.commands)
    episode = planned_episode(scene, script, 1.0, 0, UNDISTURBED)
    if getattr(recipe.simulation.scenes, scene).object is None:
        episode.fixed.pop("object_mass")
    environment = VectorEnv(Specification(recipe, folder), num_envs=1, workers=0, seed=0, episodes=(episode,))
    try:
        environment.reset()
        return environment.batch.targets(np.zeros((1, len(robot.support))))[0, robot.interaction]
    finally:
        environment.close()


@pytest.mark.parametrize(("trained", "played"), [(one, scene) for one, scenes in PLAYED_AS.items() for scene in scenes])
def test_the_load_agnostic_baselines_arms_expect_in_trials_what_they_did_in_training(
    folder: Path, robot: Robot, trained: str, played: str
) -> None:
    agnostic = load_recipe(RECIPES / "wbc.yaml").recipe
    in_training = arm_targets(agnostic, folder, robot, trained)
    np.testing.assert_array_equal(arm_targets(agnostic, folder, robot, played), in_training)
    expecting = with_changes(agnostic, {f"task.references.loads.{played}": 3.5})
    assert np.abs(arm_targets(expecting, folder, robot, played) - in_training).max() > 0.02


def test_the_load_agnostic_baselines_arms_expect_nothing_in_any_scene_of_the_trials(folder: Path) -> None:
    agnostic = load_recipe(RECIPES / "wbc.yaml").recipe
    assert agnostic.eval.scenes
    loads = dict(evaluated_world(Specification(agnostic, folder)).recipe.task.references.loads)
    assert {name for name, load in loads.items() if load} == set()
    assert set(agnostic.eval.scenes) <= loads.keys()
