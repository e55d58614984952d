"""What a rollout leaves for learning: one row of float32 numbers a sample, and its advantages."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from torch import Tensor

Array = NDArray[np.float32]


class Rollout(RolloutBuffer):  # type: ignore[misc]
    """Samples of T steps of n environments as rows, so that an epoch shuffles them with a single gather.

    `columns` are views of the rows by name: the prepared observation, the action, what the policy and the value were
    before the update, and what is learnt from.
    """

    def reset(self) -> None:
        """Room for a rollout; made once, and written over by each."""
        if hasattr(self, "rows"):
            return
        (observation,), actions = self.obs_shape, self.action_dim
        sizes = {
            "observation": observation,
            "action": actions,
            "mean": actions,
            "log_density": 1,
            "value": 1,
            "advantage": 1,
            "target": 1,
        }
        ends = np.cumsum(list(sizes.values())).tolist()
        self.places = {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}
        self.rows = torch.zeros(self.buffer_size, self.n_envs, ends[-1])
        self.columns = self.named(self.rows)
        self.rewards = np.zeros((self.buffer_size, self.n_envs), np.float32)
        self.ended = np.zeros((self.buffer_size, self.n_envs), np.bool_)

    def named(self, rows: Tensor) -> dict[str, Tensor]:
        """Views of rows (..., width) by the name of the columns; single columns without their axis."""
        views = {name: rows[..., place] for name, place in self.places.items()}
        single = ("log_density", "value", "advantage", "target")
        return {name: view[..., 0] if name in single else view for name, view in views.items()}

    @property
    def flat(self) -> Tensor:
        """All samples, (T·n, width)."""
        return self.rows.view(-1, self.rows.shape[-1])

    def finish(self, last_value: Array, discount: float, decay: float) -> None:
        """Advantages, and targets of the value, from rewards, ends and values; `last_value`: behind the last step."""
        values = self.columns["value"].numpy()
        found = advantages(self.rewards, self.ended, values, last_value, discount, decay)
        self.columns["advantage"].copy_(torch.from_numpy(found))
        self.columns["target"].copy_(torch.from_numpy(found + values))


def advantages(
    rewards: Array, ended: NDArray[np.bool_], values: Array, last_value: Array, discount: float, decay: float
) -> Array:
    """Generalised advantage estimates (Schulman et al. 2016, eq. 16), (T, n).

    rewards, values: (T, n), the value before each step; ended: (T, n), where an episode ended with the step;
    last_value: (n,), behind the last step. Nothing passes from one episode to the one before: where an episode was cut
    off by its time limit, the reward of its last step must hold the discounted value of what it was cut off from.
    """
    found: Any = np.zeros_like(rewards)
    carried, following = np.zeros_like(last_value), last_value
    for step in reversed(range(len(rewards))):
        goes_on = ~ended[step]
        surprise = rewards[step] + discount * following * goes_on - values[step]
        carried = surprise + discount * decay * carried * goes_on
        found[step] = carried
        following = values[step]
    return np.asarray(found, np.float32)
