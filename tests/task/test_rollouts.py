"""Rollouts that the environments make themselves: the same as step by step, and for any number of workers."""

import dataclasses
import functools
import itertools
import os
import signal
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from faulty import StepBy

from iowbc.errors import WorkerFailed
from iowbc.rollouts.blocks import block_size
from iowbc.rollouts.policies import Layers, Linear, Normal, RowPolicy
from iowbc.rollouts.rollout import ExploringPolicy, Trajectories
from iowbc.task.batch import Batch
from iowbc.task.vector.vector_env import VectorEnv
from iowbc.task.vector.worker import Message
from iowbc.task.vector.workers import WorkerProcesses

Make = Callable[..., VectorEnv]
STEPS = 30


def explorer(env: VectorEnv, steps: int = STEPS) -> ExploringPolicy:
    """A policy that nobody trained, with noise."""
    random = np.random.default_rng(0)
    sizes = (env.layout.size, 32, 15)
    weights = [0.1 * random.normal(size=shape).astype(np.float32) for shape in itertools.pairwise(sizes)]
    layers = [Linear(weight, np.zeros(weight.shape[1], np.float32)) for weight in weights]
    normal = Normal(np.zeros(sizes[0], np.float32), np.ones(sizes[0], np.float32), 10.0)
    noise = 0.3 * random.normal(size=(steps, env.num_envs, 15)).astype(np.float32)
    return ExploringPolicy(RowPolicy(normal, Layers(tuple(layers), "elu")), noise, block_size(env.num_envs))


def same(first: Trajectories, second: Trajectories) -> bool:
    names = [field.name for field in dataclasses.fields(Trajectories) if field.name not in ("told", "acting")]
    return all(np.array_equal(getattr(first, name), getattr(second, name)) for name in names)


def test_a_rollout_is_what_its_actions_make_step_by_step(make: Make) -> None:
    env, other = make(num_envs=4), make(num_envs=4)
    first = env.reset()
    assert np.array_equal(other.reset(), first)
    found = env.roll(explorer(env), STEPS)
    assert np.array_equal(found.observation[0], first)
    cut: list[Any] = []
    for step in range(STEPS):
        observation, reward, ended, infos = other.step(found.action[step])
        assert np.array_equal(found.observation[step + 1], observation)
        assert np.array_equal(found.reward[step], reward)
        assert np.array_equal(found.ended[step], ended)
        for index in np.flatnonzero(ended):
            if infos[index]["TimeLimit.truncated"]:
                cut.append((step, index, infos[index]["terminal_observation"]))
    assert cut, "no episode was cut off, of which the test is, too"
    assert found.cut.tolist() == [[step, index] for step, index, _ in cut]
    assert np.array_equal(found.cut_observation, [last for _, _, last in cut])
    assert env.statistics() == other.statistics()


@pytest.mark.parametrize("workers", [1, 3])
def test_a_rollout_is_the_same_for_any_number_of_workers(make: Make, workers: int) -> None:
    here, there = make(num_envs=18), make(num_envs=18, workers=workers)
    assert np.array_equal(here.reset(), there.reset())
    for _ in range(2):
        assert same(here.roll(explorer(here), STEPS), there.roll(explorer(there), STEPS))
    assert here.statistics() == there.statistics()


def test_a_worker_that_dies_or_fails_in_a_rollout_is_noticed(make: Make) -> None:
    env = make(num_envs=16, workers=2)
    env.reset()
    noise = np.zeros((STEPS, 16, 15), np.float32)
    noise[:, :8] = np.nan
    broken = dataclasses.replace(explorer(env), noise=noise)
    with pytest.raises(WorkerFailed, match=r"(?s)worker 0 .*environments \[0, 1, .* are not finite"):
        env.roll(broken, STEPS)
    env = make(num_envs=16, workers=2)
    env.reset()
    assert isinstance(env.workers, WorkerProcesses)
    os.kill(env.workers.processes[1], signal.SIGKILL)
    with pytest.raises(WorkerFailed, match=r"worker 1 .*environments 8 to 15\) died with exit status -9"):
        env.roll(explorer(env), STEPS)


def test_a_worker_that_makes_steps_does_not_count_as_hung(make: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    env = make(num_envs=2, workers=1, patience=1.0)
    env.reset()
    env.roll(explorer(env, 3), 3)
    workers = env.workers
    assert isinstance(workers, WorkerProcesses)
    workers.ask([Message(Batch.levels, changes=False)])
    assert workers._steps() == 3 * 2
    workers.answers()
    monkeypatch.setattr(workers, "_steps", itertools.count().__next__)
    env.workers.call([StepBy(functools.partial(time.sleep, 1.6))])
    env.step(np.zeros((2, 15)))
