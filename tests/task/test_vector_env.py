"""The vector environment as stable-baselines3 sees it."""

from collections.abc import Callable

import numpy as np
import pytest
from changes import with_changes
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize
from task_worlds import actions, rollout

from iowbc.recipe.recipe import Recipe
from iowbc.task.curriculum import AXES
from iowbc.task.gym.environment import Environment
from iowbc.task.record.signals import signal_sizes
from iowbc.task.record.statistics import CAUSES, ERRORS, KINDS, REASONS
from iowbc.task.rewards.table import TERMS
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]


def test_it_steps_exactly_as_single_environments_in_sb3s_own_vector_environment(make: Make, recipe: Recipe) -> None:
    changes = {"task.curriculum.enabled": False, "task.scenes.free": 0.0}
    ours = make(num_envs=3, workers=2, changes=changes)
    theirs = DummyVecEnv([lambda: Environment("lift", with_changes(recipe, changes))] * 3)
    ours.seed(11)
    theirs.seed(11)
    assert np.array_equal(ours.reset(), theirs.reset())
    ended = set()
    for step in range(150):
        mine, his = ours.step(actions(step, 3)), theirs.step(actions(step, 3))
        for ours_part, theirs_part in zip(mine[:3], his[:3], strict=True):
            assert np.array_equal(ours_part, theirs_part)
        for index in np.flatnonzero(mine[2]):
            got, expected = mine[3][index], his[3][index]
            assert np.array_equal(got["terminal_observation"], expected["terminal_observation"])
            assert got["TimeLimit.truncated"] == expected["TimeLimit.truncated"]
            ended.add(got["TimeLimit.truncated"])
    assert ended == {True, False}, "the test should see time limits and falls"


def test_an_episode_that_only_ran_out_of_time_is_truncated_and_a_fall_is_not(make: Make) -> None:
    env = make(num_envs=8)
    env.reset()
    for step in range(120):
        _, _, done, infos = env.step(actions(step, 8))
        for index in np.flatnonzero(done):
            failures = [name for name in ("fallen", "dropped", "lagging") if env.signals[name][index, 0]]
            assert infos[index]["TimeLimit.truncated"] == (not failures)
            assert infos[index]["end"] == (failures[0] if failures else "time_limit")
        assert not any(infos[index] for index in np.flatnonzero(~done))


def test_the_terminal_observation_belongs_to_the_old_episode_and_the_observation_to_the_new(make: Make) -> None:
    env = make(num_envs=8)
    env.reset()
    place = env.layout.state.slices["last_action"]
    for step in range(120):
        given = actions(step, 8)
        observation, _, done, infos = env.step(given)
        assert np.array_equal(observation[~done, place], given[~done])
        for index in np.flatnonzero(done):
            assert np.array_equal(infos[index]["terminal_observation"][place], given[index])
            assert not observation[index, place].any()


def test_signals_hold_values_from_before_the_automatic_reset(make: Make) -> None:
    env = make(num_envs=4)
    env.reset()
    seen = rollout(env, 120, size=1.0)
    ends = seen["fallen"][..., 0] > 0
    assert ends.any()
    lowered = np.abs(seen["torso_pitch"] - seen["torso_pitch_command"])[..., 0]
    assert lowered[ends].min() > 0.2, "a robot that fell leans, one that was reset does not"


def test_episode_infos_add_up(make: Make) -> None:
    env = make(num_envs=4)
    env.reset()
    rewards, steps = np.zeros(4), np.zeros(4, int)
    for step in range(150):
        _, reward, done, infos = env.step(actions(step, 4))
        rewards, steps = rewards + reward, steps + 1
        for index in np.flatnonzero(done):
            assert infos[index]["episode"]["r"] == pytest.approx(rewards[index], abs=1e-4)
            assert infos[index]["episode"]["l"] == steps[index]
            rewards[index], steps[index] = 0.0, 0


def test_rewards_are_the_sum_of_their_terms(make: Make) -> None:
    env = make(num_envs=4)
    env.reset()
    seen = rollout(env, 100)
    figures = env.statistics()
    terms = sum(value for name, value in figures.items() if name.startswith("reward/"))
    assert figures["reward"] == pytest.approx(terms)
    assert figures["reward"] == pytest.approx(seen["reward"].mean() * 50, rel=1e-5)


def test_statistics_are_complete_and_finite_from_the_first_call(make: Make) -> None:
    env = make()
    env.reset()
    expected = {"reward", "episode_seconds", "episode_return", "curriculum_level", "tracking", "divergences"}
    expected |= {"infeasible_pushes"}
    expected |= {f"reward/{term}" for term in TERMS} | {f"terminations/{name}" for name in REASONS}
    expected |= {f"falls/{cause}" for cause in CAUSES} | {f"level/{axis}" for axis in AXES}
    expected |= {f"error/{s}/{kind}/{e}" for s in ("free", "lift") for kind in KINDS for e in ERRORS}
    for _ in range(2):
        figures = env.statistics()
        assert figures.keys() == expected
        assert all(np.isfinite(value) for value in figures.values())


def test_statistics_carry_the_last_value_where_no_episode_ended(make: Make) -> None:
    env = make(num_envs=4)
    env.reset()
    rollout(env, 100)
    before = env.statistics()
    after = env.statistics()
    assert before["episode_seconds"] > 0.2
    assert after["episode_seconds"] == before["episode_seconds"]
    assert after["terminations/fallen"] + after["terminations/time_limit"] == pytest.approx(1.0)
    assert after["reward"] == 0.0


def test_observations_and_actions_fit_their_spaces(make: Make) -> None:
    env = make()
    observation = env.reset()
    assert observation.shape == (4, env.layout.size) == (4, *env.observation_space.shape)
    assert observation.dtype == np.float32
    assert env.action_space.shape == (15,)
    sizes = signal_sizes(env.batch.robot, planned=False)
    assert {name: values.shape for name, values in env.signals.items()} == {k: (4, v) for k, v in sizes.items()}
    assert env.layout.observation.stop == env.layout.privileged.start


def test_returned_arrays_are_not_overwritten_by_the_next_step(make: Make) -> None:
    env = make()
    env.reset()
    first = env.step(actions(0, 4))
    kept = [part.copy() for part in first[:3]]
    env.step(actions(1, 4))
    assert all(np.array_equal(part, copy) for part, copy in zip(first[:3], kept, strict=True))


def test_actions_that_are_not_numbers_are_refused(make: Make) -> None:
    env = make()
    env.reset()
    wrong = actions(0, 4)
    wrong[2, 5] = np.nan
    with pytest.raises(ValueError, match=r"environments \[2\] are not finite"):
        env.step(wrong)
    with pytest.raises(ValueError, match=r"shape \(3, 15\), expected \(4, 15\)"):
        env.step(actions(0, 3))


def test_actions_beyond_the_bound_act_like_the_bound(make: Make) -> None:
    first, second = make(seed=3), make(seed=3)
    first.reset(), second.reset()
    bound = first.action_space.high[0]
    one = first.step(np.full((4, 15), 3.0 * bound, np.float32))
    other = second.step(np.full((4, 15), bound, np.float32))
    assert np.array_equal(one[0], other[0])


def test_seeding_repeats_a_rollout(make: Make) -> None:
    env = make(changes={"task.curriculum.enabled": False})
    env.seed(5)
    first, one = env.reset(), rollout(env, 20)
    second, two = env.reset(), rollout(env, 20)
    assert not np.array_equal(first, second)
    env.seed(5)
    assert np.array_equal(first, env.reset())
    assert np.array_equal(one["observation"], rollout(env, 20)["observation"])
    assert not np.array_equal(one["observation"], two["observation"])


def test_attributes_of_single_environments_can_be_read_and_levels_set(make: Make) -> None:
    env = make(num_envs=4, workers=2)
    env.reset()
    assert env.get_attr("scene") == ["free", "free", "lift", "lift"]
    env.set_attr("level", 1.5, indices=[1, 2])
    assert env.get_attr("level") == [dict.fromkeys(AXES, value) for value in (0.0, 1.5, 1.5, 0.0)]
    env.set_attr("level", {"load": 0.5}, indices=2)
    assert env.get_attr("level", indices=2) == [dict.fromkeys(AXES, 1.5) | {"load": 0.5}]
    assert env.env_method("drawn", indices=[3])[0]["object_mass"] == env.drawn()["object_mass"][3]
    assert env.env_is_wrapped(VecNormalize) == [False] * 4
    with pytest.raises(AttributeError, match="there are scene, level"):
        env.get_attr("altitude")
    with pytest.raises(AttributeError, match="there is drawn"):
        env.env_method("fly")


def test_levels_carry_over_to_another_number_of_environments(make: Make) -> None:
    source, target = make(num_envs=4), make(num_envs=6)
    for index, level in enumerate((0.0, 0.5, 1.0, 2.0)):
        source.set_attr("level", level, indices=index)
    known = source.curriculum()["levels"]
    assert known == {"free": {axis: [0.0, 0.5] for axis in AXES}, "lift": {axis: [1.0, 2.0] for axis in AXES}}
    target.set_curriculum(source.curriculum())
    for axis in AXES:
        levels = [level[axis] for level in target.get_attr("level")]
        assert np.mean(levels[:3]) == pytest.approx(0.25)
        assert np.mean(levels[3:]) == pytest.approx(1.5)
    own = make(num_envs=6, changes={"task.curriculum.enabled": False, "task.curriculum.inherit": False})
    own.set_curriculum(source.curriculum())
    assert own.get_attr("level") == [dict.fromkeys(AXES, 1.0)] * 6


def test_scenes_are_played_in_the_recipes_shares(make: Make) -> None:
    shares = {"free": 0.25, "lift": 0.5, "tyre": 0.0, "push": 0.25}
    env = make(num_envs=8, changes={f"task.scenes.{name}": share for name, share in shares.items()})
    assert env.get_attr("scene") == ["free"] * 2 + ["lift"] * 4 + ["push"] * 2
    assert np.isfinite(env.reset()).all()
    assert np.isfinite(rollout(env, 10)["observation"]).all()


def test_a_count_that_does_not_fit_is_refused(make: Make) -> None:
    with pytest.raises(ValueError, match="at least one environment"):
        make(num_envs=0)
