"""Interface between learners and environments."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from iowbc.rollouts.rollout_policies import RolloutPolicy
from iowbc.rollouts.trajectories import Trajectories


class Environments(Protocol):
    """Stable-baselines3 vector environment that makes whole rollouts and can be saved and restored, such as the task's
    `VectorEnv`."""

    num_envs: int
    observation_space: Any
    action_space: Any

    def reset(self) -> NDArray[np.float32]:
        """Start an episode in every environment; returns observations, (num_envs, size)."""

    def roll(self, rollout_policy: RolloutPolicy, steps: int) -> Trajectories:
        """Make a rollout of `steps` control steps."""

    def statistics(self) -> dict[str, float]:
        """Statistics since the last call."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Complete state, for a checkpoint."""

    def restore(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `state`."""
