"""How episodes are recorded, on an environment whose every signal is known."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from iowbc.errors import Interrupted
from iowbc.evaluation.trials.rollout import play_in
from iowbc.robot.description import load_robot, robot_folder
from iowbc.task.record.signals import RECORDED, signal_sizes

WIDTHS = signal_sizes(load_robot(robot_folder("g1")), planned=True)


class CountingEnvironment:
    """Environment i ends after `ends[i]` steps, in the way of `ways[i]`, and starts anew; torso pitch counts steps."""

    period = 0.02

    def __init__(self, ends: list[int], ways: list[str]) -> None:
        self.num_envs, self.ends, self.ways = len(ends), ends, ways
        self.layout = SimpleNamespace(observation=slice(0, 4), privileged=slice(4, 6))
        names = (*RECORDED, "fallen", "dropped")
        self.signals = {name: np.zeros((self.num_envs, WIDTHS[name])) for name in names}
        self.steps = np.zeros(self.num_envs, int)

    def reset(self) -> NDArray[np.float32]:
        return np.zeros((self.num_envs, 6), np.float32)

    def drawn(self) -> dict[str, NDArray[np.float64]]:
        return {"object_mass": np.arange(self.num_envs, dtype=float), "kp_scale": np.ones((self.num_envs, 29))}

    def step(self, action: NDArray[np.float32]) -> tuple[Any, Any, NDArray[np.bool_], list[dict[str, bool]]]:
        self.steps += 1
        self.signals["torso_pitch"][:, 0] = self.steps
        done = self.steps >= self.ends
        infos = []
        for index, way in enumerate(self.ways):
            for name in ("fallen", "dropped"):
                self.signals[name][index] = done[index] and way == name
            infos.append({"TimeLimit.truncated": bool(done[index] and way == "time_limit")})
        self.steps[done] = 0
        return self.reset(), np.zeros(self.num_envs), done, infos


class Recorder:
    """A policy that remembers which environments were reset."""

    def __init__(self) -> None:
        self.resets: list[list[bool]] = []

    def reset(self, which: NDArray[np.bool_]) -> None:
        self.resets.append(which.tolist())

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        assert (observation.shape[1], privileged.shape[1]) == (4, 2)
        return np.zeros((len(observation), 15), np.float32)


def played(ends: list[int], ways: list[str], **options: Any) -> Any:
    environment: Any = CountingEnvironment(ends, ways)
    return play_in(environment, Recorder(), **options)


def test_each_episode_is_recorded_once_up_to_its_first_end() -> None:
    short, long = played([3, 10], ["fallen", "time_limit"])
    assert short.trace.torso_pitch.tolist() == [1, 2, 3]
    assert long.trace.torso_pitch.tolist() == list(range(1, 11))
    assert (short.seconds, long.seconds) == pytest.approx((0.06, 0.2))


def test_endings_are_told_apart() -> None:
    ways = ["fallen", "dropped", "time_limit", "diverged"]
    trials = played([2, 2, 2, 2], ways)
    assert [trial.ending for trial in trials] == ["fell", "dropped", "finished", "diverged"]
    assert [trial.survived for trial in trials] == [False, False, True, False]


def test_what_was_drawn_is_kept_by_trial() -> None:
    first, second = played([2, 2], ["time_limit", "time_limit"])
    assert (first.drawn["object_mass"], second.drawn["object_mass"]) == (0.0, 1.0)
    assert second.drawn["kp_scale"].shape == (29,)


def test_a_policy_forgets_at_the_start_of_every_episode() -> None:
    environment: Any = CountingEnvironment([2, 3], ["fallen", "time_limit"])
    policy = Recorder()
    play_in(environment, policy)
    assert policy.resets == [[True, True], [True, False], [False, True]]


def test_traces_have_the_shapes_that_metrics_need() -> None:
    (trial,) = played([4], ["time_limit"])
    assert trial.trace.system_velocity.shape == (4, 3)
    assert trial.trace.heading.shape == (4,)
    assert trial.trace.foot_load.shape == (4, 2)
    assert trial.trace.joint_torque.shape == (4, 29)


def test_an_interruption_stops_at_once() -> None:
    with pytest.raises(Interrupted, match="2 episodes"):
        played([5, 5], ["time_limit", "time_limit"], interrupted=lambda: True)


def test_a_film_sees_the_first_episode_from_reset_to_end() -> None:
    seen: list[float] = []
    played([3, 9], ["fallen", "time_limit"], look=seen.append)
    assert seen == pytest.approx([0.0, 0.02, 0.04])
