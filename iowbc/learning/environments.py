"""Interface between learners and environments."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from iowbc.rollouts.rollout import RolloutPolicy, Trajectories


class Environments(Protocol):
    """Vector environment of stable-baselines3 that makes whole rollouts and can be saved, such as `VectorEnv`."""

    num_envs: int
    observation_space: Any
    action_space: Any

    def reset(self) -> NDArray[np.float32]:
        """Start an episode in every environment; returns observations, (num_envs, size)."""

    def roll(self, rollout_policy: RolloutPolicy, steps: int) -> Trajectories:
        """Make a rollout of `steps` control steps."""

    def copy(self, source: NDArray[np.int64]) -> NDArray[np.float32]:
        """Each environment continues from the state of environment `source`, (num_envs,); returns observations."""

    def statistics(self) -> dict[str, float]:
        """Statistics since the last call."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Complete state, for a checkpoint."""

    def restore(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `state`."""
