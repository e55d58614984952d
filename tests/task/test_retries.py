"""Failed episodes are tried again from a state before the failure."""

from collections.abc import Callable
from typing import Any

import numpy as np
from task_worlds import actions, rollout, same

from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]
ALWAYS = {f"task.scenes.{name}": 0.25 for name in ("free", "lift", "tyre", "push")} | {
    "task.curriculum.retry": 1.0,
    "task.curriculum.retry_period": 0.2,
}


def test_a_failed_episode_goes_on_from_one_to_two_periods_before(make: Make) -> None:
    env = make(num_envs=8, changes=ALWAYS)
    env.reset()
    again = 0
    for step in range(150):
        before = env.batch.memory.steps + 1
        key = env.batch.snapshot()["task/episode_key"]
        _, _, done, infos = env.step(actions(step, 8))
        for row in _failed(done, infos):
            if before[row] <= 20:
                continue
            again += 1
            steps = env.batch.memory.steps[row]
            assert steps % 10 == 0
            assert 10 <= before[row] - steps <= 20
            assert env.batch.snapshot()["task/episode_key"][row] == key[row]
    assert again > 5


def test_the_same_actions_fail_in_the_same_way(make: Make) -> None:
    env = make(num_envs=4, changes=ALWAYS)
    env.reset()
    rows = np.arange(4)
    falls: list[list[int]] = [[] for _ in rows]
    for _ in range(200):
        before = env.batch.memory.steps.copy()
        _, _, done, infos = env.step(actions(0, 4))
        for row in _failed(done, infos):
            falls[row].append(int(before[row]))
    assert sum(map(len, falls)) > 10
    assert all(len(set(steps)) <= 1 for steps in falls), falls


def _failed(done: Any, infos: list[dict[str, Any]]) -> list[int]:
    return [row for row in np.flatnonzero(done).tolist() if not infos[row]["TimeLimit.truncated"]]


def test_attempts_do_not_depend_on_workers_and_resume_bit_for_bit(make: Make) -> None:
    one, two = (make(num_envs=8, workers=workers, changes=ALWAYS) for workers in (0, 2))
    one.reset(), two.reset()
    for start in (0, 40, 80):
        assert same(rollout(one, 40, start=start), rollout(two, 40, start=start))
        if start == 40:
            two.restore(one.state())
    for name, values in one.state().items():
        np.testing.assert_array_equal(values, two.state()[name], err_msg=name)


def test_without_retries_no_state_is_kept(make: Make) -> None:
    env = make(num_envs=2)
    env.reset()
    rollout(env, 3)
    assert not [name for name in env.state() if name.startswith(("older/", "newer/"))]
