"""A simulation that leaves the numbers."""

from collections.abc import Callable

import numpy as np
from task_worlds import actions

from iowbc.recipe.task.reward import Reward
from iowbc.task.curriculum import AXES
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]


def plant_nan(env: VectorEnv, index: int) -> None:
    world, place = env.batch.simulation.world_of(index)
    world.qvel[place, 7] = np.nan


def test_a_nan_resets_that_environment_alone_and_is_counted(make: Make) -> None:
    env, calm = make(), make()
    env.reset(), calm.reset()
    for step in range(10):
        env.step(actions(step, 4, 0.2)), calm.step(actions(step, 4, 0.2))
    plant_nan(env, 2)
    observation, reward, done, infos = env.step(actions(10, 4, 0.2))
    expected = calm.step(actions(10, 4, 0.2))
    assert done.tolist() == [False, False, True, False]
    others = [0, 1, 3]
    assert np.array_equal(observation[others], expected[0][others])
    assert np.array_equal(reward[others], expected[1][others])
    assert np.isfinite(observation).all()
    assert np.isfinite(infos[2]["terminal_observation"]).all()
    assert reward[2] == Reward().termination, "like a fall: no way out of a bad episode"
    assert infos[2]["end"] == "diverged"
    assert not infos[2]["TimeLimit.truncated"]
    assert env.signals["diverged"][:, 0].tolist() == [0.0, 0.0, 1.0, 0.0]
    figures = env.statistics()
    assert figures["divergences"] == 1.0
    assert figures["terminations/diverged"] == 1.0
    assert env.statistics()["divergences"] == 0.0


def test_a_divergence_does_not_move_the_curriculum(make: Make) -> None:
    env = make()
    env.set_attr("level", 1.0)
    env.reset()
    plant_nan(env, 1)
    env.step(actions(0, 4))
    assert env.get_attr("level")[1] == dict.fromkeys(AXES, 1.0)
