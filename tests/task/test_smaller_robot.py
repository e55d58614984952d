"""The environments of a robot with fewer joints."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from iowbc.robot.description import Robot
from iowbc.task.vector.vector_env import VectorEnv

STEPS = 30


@pytest.fixture(scope="module")
def folder(robot_of_23: Robot) -> Path:
    return robot_of_23.folder


def test_a_robot_of_23_joints_is_stepped_and_mirrored(make: Callable[..., VectorEnv]) -> None:
    env = make(num_envs=4)
    rows, random = env.reset(), np.random.default_rng(0)
    assert env.action_space.shape == (13,)
    assert rows.shape == (4, env.layout.size)
    assert env.layout.state.slices["joint_position"] == slice(18, 41)
    for _ in range(STEPS):
        rows, reward, _, _ = env.step(0.2 * random.normal(size=(4, 13)).astype(np.float32))
        assert np.isfinite(rows).all()
        assert np.isfinite(reward).all()
    assert np.array_equal(env.layout.mirror(env.layout.mirror(rows)), rows)
