"""The single environments that gymnasium knows by name."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_by_sb3
from task_worlds import actions

import iowbc.task.gym.registration  # noqa: F401
from iowbc.task.gym.environment import Environment

NAMES = ("iowbc/Free-v0", "iowbc/Lift-v0", "iowbc/Push-v0")


def test_a_name_with_its_module_needs_no_import_before() -> None:
    env = gymnasium.make("iowbc.task.gym.registration:iowbc/Tyre-v0", disable_env_checker=True)
    assert env.reset(seed=0)[0].shape == env.observation_space.shape


@pytest.mark.parametrize("name", NAMES)
def test_it_passes_the_checkers_of_gymnasium_and_sb3(name: str) -> None:
    env = gymnasium.make(name, disable_env_checker=True).unwrapped
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*(recommend|probably too).*")
        check_env(env, skip_render_check=True)
        check_env_by_sb3(env)
    env.close()


def test_a_seed_repeats_an_episode() -> None:
    env = gymnasium.make("iowbc/Lift-v0", disable_env_checker=True)
    courses = []
    for _ in range(2):
        course = [env.reset(seed=3)[0]]
        course += [env.step(actions(step, 1)[0])[0] for step in range(20)]
        courses.append(np.stack(course))
    assert np.array_equal(*courses)
    assert not np.array_equal(courses[0][0], env.reset()[0])


def test_an_episode_ends_in_a_fall_with_its_last_observation() -> None:
    env = gymnasium.make("iowbc/Free-v0", disable_env_checker=True)
    env.reset(seed=0)
    for step in range(500):
        action = actions(step, 1, 2.0)[0]
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated:
            break
    assert terminated
    assert not truncated
    state = env.unwrapped.batch.layout.state  # type: ignore[attr-defined]
    assert np.array_equal(observation[state.slices["last_action"]], np.clip(action, -5.0, 5.0))


def test_unknown_scenes_and_render_modes_are_refused() -> None:
    with pytest.raises(ValueError, match="mars"):
        gymnasium.make("iowbc/Lift-v0", scene="mars", disable_env_checker=True)
    with pytest.raises(ValueError, match="rgb_array"):
        Environment(render_mode="human")
