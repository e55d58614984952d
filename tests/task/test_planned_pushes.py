"""Pushes on the base at set times."""

import numpy as np
import pytest

from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.task.episodes import CommandScript, CommandSegment, Episode, PlannedPush, PlannedPushes
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

PERIOD = 0.02
MASS = 33.3
"""Of the robot [kg]."""
PUSH = PlannedPush(time=0.1, duration=0.06, impulse=(30.0, 0.0))


def test_the_force_over_the_duration_makes_the_impulse_in_the_frame_of_the_heading() -> None:
    pushes = PlannedPushes([PUSH, None], PERIOD)
    heading = np.array([np.pi / 2, 0.0])
    total = sum(PERIOD * pushes.force(np.full(2, step), heading) for step in range(20))
    assert total == pytest.approx(np.array([[0.0, 30.0, 0.0], [0.0, 0.0, 0.0]]), abs=1e-9)
    assert not pushes.force(np.full(2, 4), heading).any()
    assert pushes.force(np.full(2, 5), heading)[0, 1] == pytest.approx(500.0)
    assert not pushes.force(np.full(2, 8), heading).any()


def test_an_episode_keeps_its_push_through_json() -> None:
    script = CommandScript((CommandSegment(1.0, tuple([0.0] * 3 + [0.72] + [0.0] * 7)),))
    for push in (PUSH, None):
        episode = Episode("free", 3, 1.0, {}, script, push)
        assert Episode.from_json(episode.as_json()) == episode


def test_a_pushed_robot_gains_the_impulse_that_an_unpushed_one_does_not(robot: Robot) -> None:
    recipe = Recipe.model_validate({"name": "test", "task": {"references": {"use_rg": False}}})
    fixed = {"push_scale": 0.0, "impulse_scale": 0.0}
    episodes = [Episode("free", 1, 2.0, fixed, None, push) for push in (PUSH, None)]
    environment = VectorEnv(Specification(recipe, robot.folder), num_envs=2, workers=0, seed=0, episodes=episodes)
    try:
        environment.reset()
        for _ in range(9):
            environment.step(np.zeros((2, 15), np.float32))
        velocity = environment.signals["system_velocity"][:, 0]
    finally:
        environment.close()
    assert velocity[0] - velocity[1] == pytest.approx(30.0 / MASS, rel=0.35), "the feet take a part of it"
