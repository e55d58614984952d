"""Scenes of the trials alone: another object or grasp for a policy that is trained already."""

import numpy as np
import pytest

from iowbc.evaluation.trials.plan import case_trials
from iowbc.evaluation.trials.protocol import evaluated_world
from iowbc.pipeline.stage import slice_value
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.robot.description import load_robot, robot_folder
from iowbc.stages.registry import STAGES
from iowbc.task.layout import full_layout
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

BUCKET = {
    "scene": {"kind": "lift", "object": {"shape": "cylinder", "size": [0.3, 0.3, 0.35], "mass": 5.0}},
    "wrists": [0.3, 0.185, 0.26],
    "load": 2.5,
}
HIGHER = {"scene": {"kind": "lift", "object": {"shape": "box", "size": [0.3, 0.25, 0.3], "mass": 7.0}}}
QUESTION = {
    "name": "test",
    "task": {"references": {"use_rg": False}},
    "eval": {
        "trials": 1,
        "lifting": None,
        "scenes": {"bucket": BUCKET, "lift": HIGHER | {"wrists": [0.3, 0.16, 0.3], "load": 3.5}},
        "heavy": [{"name": "bucket", "scene": "bucket", "mass": 5.0}, {"name": "box", "scene": "lift", "mass": 4.0}],
    },
}
RECIPE = Recipe.model_validate(QUESTION)
TRAINED = Recipe.model_validate({**QUESTION, "eval": {}})


def test_the_policys_keys_and_what_it_observes_stay_those_of_the_training() -> None:
    own, before = deciding(RECIPE), deciding(TRAINED)
    for stage in (STAGES["teacher"], STAGES["distill"], STAGES["export"]):
        for path in stage.slice:
            assert slice_value(own, path, stage) == slice_value(before, path, stage), path
    robot = load_robot(robot_folder("g1"))
    world = evaluated_world(Specification(RECIPE, robot_folder("g1"))).recipe
    assert full_layout(world, robot).describe() == full_layout(TRAINED, robot).describe()


def test_trials_are_played_with_the_new_object_and_at_the_new_grasp() -> None:
    world = evaluated_world(Specification(RECIPE, robot_folder("g1")))
    episodes = [trial.episode for trial in case_trials(world.recipe)]
    with_grasp = VectorEnv(world, num_envs=2, workers=0, seed=0, episodes=episodes)
    before = VectorEnv(Specification(TRAINED, robot_folder("g1")), num_envs=1, workers=0, seed=0, episodes=episodes[1:])
    try:
        for environment in (with_grasp, before):
            environment.reset()
            environment.step(np.zeros((environment.num_envs, 15), np.float32))
        assert list(with_grasp.batch.scenes) == ["bucket", "lift"]
        assert with_grasp.drawn()["object_mass"].tolist() == [5.0, 4.0]
        own, trained = with_grasp.signals["object_position"][1], before.signals["object_position"][0]
        assert own[2] - trained[2] == pytest.approx(0.04, abs=0.02), "held four centimetres higher"
    finally:
        with_grasp.close()
        before.close()


def test_a_scene_that_there_is_not_is_told_with_those_that_there_are() -> None:
    wrong = {"eval": {"heavy": [{"name": "a", "scene": "buckets", "mass": 5.0}], "scenes": {"bucket": BUCKET}}}
    with pytest.raises(ValueError, match=r"no scene 'buckets' with an object; valid: .*bucket.*did you mean 'bucket'"):
        Recipe.model_validate({"name": "test", **wrong})
