"""Planned episodes: every policy meets the same trial, wherever it is played."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from task_worlds import actions, rollout, same

from iowbc.task.episodes import CommandScript, CommandSegment, Episode
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]

STAND = (0.0, 0.0, 0.0, 0.72, 0.0, *(0.0,) * 6)
TURN = (0.0, 0.0, 0.3, 0.72, 0.0, *(0.0,) * 6)
SCRIPT = CommandScript((CommandSegment(0.2, STAND), CommandSegment(0.6, TURN, 0.4)))


def episode(scene: str = "lift", seed: int = 5, duration: float = 0.5, **fixed: float) -> Episode:
    return Episode(scene=scene, seed=seed, duration=duration, fixed=fixed, script=SCRIPT)


def test_an_episode_ends_at_its_own_time_limit(make: Make) -> None:
    env = make(num_envs=2, episodes=[episode(duration=0.3), episode(duration=0.5)])
    env.reset()
    ends: dict[int, int] = {}
    for step in range(25):
        _, _, done, infos = env.step(np.zeros((2, 15), np.float32))
        for index in np.flatnonzero(done):
            ends.setdefault(int(index), step + 1)
            assert infos[index]["TimeLimit.truncated"]
    assert ends == {0: 15, 1: 25}


def test_what_is_drawn_depends_on_the_episodes_seed_and_not_on_its_place(make: Make) -> None:
    one = make(num_envs=1, seed=1, episodes=[episode(seed=5)])
    many = make(num_envs=3, seed=2, workers=2, episodes=[episode(seed=4), episode("free"), episode(seed=5)])
    first, all_of_them = one.reset()[0], many.reset()
    assert np.array_equal(first, all_of_them[2])
    assert not np.array_equal(first, all_of_them[0])
    drawn, others = one.drawn(), many.drawn()
    assert all(np.array_equal(values[0], others[name][2]) for name, values in drawn.items())
    free, lift = others["link_mass_scale"][1], others["link_mass_scale"][2]
    assert np.array_equal(free, lift), "the robot is the same, with and without an object"


def test_a_reset_plays_the_same_episode_again(make: Make) -> None:
    env = make(num_envs=2, episodes=[episode(seed=5), episode(seed=6)])
    courses = [{"start": env.reset()} | rollout(env, 20) for _ in range(2)]
    assert same(*courses)


def test_an_episode_does_not_depend_on_the_one_before(make: Make) -> None:
    scenes = ("free", "lift", "squeeze", "tyre", "push")
    shares = {f"task.scenes.{name}": 0.2 for name in scenes}
    episodes = [episode(scene, seed=seed) for seed, scene in enumerate(scenes * 3)]
    env = make(num_envs=len(episodes), changes=shares, episodes=episodes)
    first, state, random = env.reset(), env.state(), np.random.default_rng(0)
    for steps in (9, 17, 25):
        for _ in range(steps):
            env.step(4.0 * random.normal(size=(len(episodes), 15)).astype(np.float32))
        assert np.array_equal(env.reset(), first)
        again = env.state()
        kept = [name for name in state if name.startswith("simulation/sens")]
        assert kept
        assert [name for name in kept if not np.array_equal(again[name], state[name])] == []


def test_fixed_quantities_are_held_and_the_rest_is_drawn(make: Make) -> None:
    env = make(num_envs=2, episodes=[episode(object_mass=4.0, partner_share=0.0), episode(seed=6)])
    env.reset()
    drawn = env.drawn()
    assert drawn["object_mass"][0] == 4.0
    assert drawn["partner_share"][0] == 0.0
    assert drawn["object_mass"][1] not in (4.0, 7.0)


def test_a_held_quantity_that_does_not_exist_is_named(make: Make) -> None:
    with pytest.raises(KeyError, match="object_masss"):
        make(num_envs=1, episodes=[episode(object_masss=4.0)])


def test_scripted_commands_arrive_as_planned_and_turn_the_heading_reference(make: Make) -> None:
    env = make(num_envs=1, episodes=[episode(duration=2.0)])
    env.reset()
    turning: list[float] = []
    reference: list[float] = []
    begin = env.drawn()["start_yaw"][0]
    for _ in range(30):
        env.step(np.zeros((1, 15), np.float32))
        turning.append(env.signals["commanded_velocity"][0, 2])
        reference.append(env.signals["heading_reference"][0, 0])
    expected = [SCRIPT.at(step / 50)[2] for step in range(30)]
    assert turning == pytest.approx(expected)
    assert np.array(reference) - begin == pytest.approx(np.cumsum(expected) / 50)


def test_trials_leave_the_curriculum_alone(make: Make) -> None:
    env = make(num_envs=1, episodes=[episode(duration=0.1)])
    env.reset()
    levels = set()
    for step in range(12):
        env.step(actions(step, 1))
        levels.update(env.signals["level"][0].tolist())
    assert levels == {1.0}


def test_episodes_survive_the_passage_through_json() -> None:
    planned = episode(object_mass=3.0)
    assert Episode.from_json(planned.as_json()) == planned


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"duration": 0.0}, "positive time, got 0.0"),
        ({"seed": -1}, "not negative, got -1"),
    ],
)
def test_impossible_episodes_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Episode(**{"scene": "lift", "seed": 0, "duration": 1.0} | change)


def test_each_environment_needs_its_episode(make: Make) -> None:
    with pytest.raises(ValueError, match="1 episodes for 2 environments"):
        make(num_envs=2, episodes=[episode()])
