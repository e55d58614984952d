"""Requests of the learners to the environments."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from iowbc.rollouts.rollout_policies import RolloutPolicy
from iowbc.rollouts.trajectories import Trajectories


class Environments(Protocol):
    """A stable-baselines3 vector environment that makes whole rollouts, and can be stopped and continued; `VectorEnv`
    of the task is one."""

    num_envs: int
    observation_space: Any
    action_space: Any

    def reset(self) -> NDArray[np.float32]:
        """Observations, (num_envs, size), at the beginning of an episode everywhere."""

    def roll(self, rollout_policy: RolloutPolicy, steps: int) -> Trajectories:
        """Make a rollout of some control steps."""

    def statistics(self) -> dict[str, float]:
        """Figures since the last call."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Everything that the future depends on."""

    def restore(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `state`."""
