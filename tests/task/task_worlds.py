"""What tests of the task share: changed recipes, random actions, rollouts."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from iowbc.task.vector.vector_env import VectorEnv

QUIET = {
    "simulation.randomization.enabled": False,
    "simulation.partner.enabled": False,
    "simulation.impulses.enabled": False,
    "simulation.pushes.enabled": False,
    "simulation.sensing.enabled": False,
}
"""Changes that leave nothing to chance but the commands."""


def actions(step: int, count: int, size: float = 0.5) -> Any:
    """Random actions of a step, the same for whoever asks, (count, 15)."""
    return (size * np.random.default_rng(step).normal(size=(64, 15))[:count]).astype(np.float32)


def rollout(env: VectorEnv, steps: int, *, start: int = 0, size: float = 0.5) -> dict[str, Any]:
    """Observations, rewards, dones and signals of steps with random actions, stacked."""
    rows: list[dict[str, Any]] = []
    for step in range(start, start + steps):
        observation, reward, done, _ = env.step(actions(step, env.num_envs, size))
        signals = {name: values.copy() for name, values in env.signals.items()}
        rows.append({"observation": observation, "reward": reward, "done": done, **signals})
    return {name: np.stack([row[name] for row in rows]) for name in rows[0]}


def same(first: Mapping[str, Any], second: Mapping[str, Any]) -> bool:
    """Whether two sets of arrays agree bit for bit."""
    return first.keys() == second.keys() and all(np.array_equal(first[name], second[name]) for name in first)
