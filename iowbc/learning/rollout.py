"""Training samples of a rollout, each a row of float32 numbers, and their advantages."""

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from iowbc.arrays import Array, Mask, places

SINGLE = ("log_density", "value", "advantage", "target")
"""Scalar columns."""


class Samples:
    """Samples of T steps of n environments as rows, so that an epoch shuffles them with a single gather.

    `columns` are views of the rows by name: prepared observation, action, the policy's mean, log density and
    value before the update, advantage and value target. Each rollout overwrites the previous one.
    """

    def __init__(self, steps: int, environments: int, observation: int, actions: int, device: torch.device) -> None:
        acting = dict.fromkeys(("action", "mean"), actions)
        sizes = {"observation": observation, **acting, **dict.fromkeys(SINGLE, 1)}
        self.places = places(sizes)
        rows = torch.zeros(steps, environments, sum(sizes.values()), device=device)
        self.columns = self.named(rows)
        self.flat = rows.view(-1, rows.shape[-1])
        """All samples, (T·n, width)."""

    def named(self, rows: Tensor) -> dict[str, Tensor]:
        """Views of rows (..., width) by column name; scalar columns drop the last axis."""
        views = {name: rows[..., place] for name, place in self.places.items()}
        return {name: view[..., 0] if name in SINGLE else view for name, view in views.items()}


def advantages(rewards: Array, ended: Mask, values: Array, last_value: Array, discount: float, decay: float) -> Array:
    """Generalised advantage estimates (Schulman et al. 2016, eq. 16), (T, n).

    rewards, values: (T, n), the value before each step; ended: (T, n), where an episode ended with the step;
    last_value: (n,), after the last step. Nothing is carried across episode ends: if an episode was truncated by its
    time limit, the reward of its last step must include the discounted value of the next state.
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


def drawn_leaders(environments: int, group: int) -> NDArray[np.int64]:
    """For each environment, the one of its group, at random, from whose state the group begins, (n,)."""
    chosen = torch.randint(group, (environments // group,)).numpy() + group * np.arange(environments // group)
    return np.repeat(chosen, group)


def without_common_part(advantage: Array, ended: Mask, group: int) -> Array:
    """Advantages (T, n) less the mean of the others in the group, times the coefficient of least squares of the step.
    `ended`: where an episode ended with the step, (T, n); from then on an environment is on its own.

    In groups, environments begin a rollout in one state, with the same random quantities (common random numbers). Most
    of an advantage's variance does not come from the actions but from disturbances, noise and the critic's errors,
    which they share. The mean of the others estimates it without bias, since it does not depend on the environment's
    own action.
    """
    own = advantage.reshape(len(advantage), -1, group)
    together = np.ones_like(own)
    together[1:] = np.cumsum(ended, axis=0)[:-1].reshape(own[1:].shape) == 0
    total, number = (own * together).sum(-1, keepdims=True), together.sum(-1, keepdims=True)
    others = together * (total - own) / np.maximum(number - 1.0, 1.0) * (number > 1.0)
    axes = (1, 2)
    slope = (others * own).sum(axes, keepdims=True) / np.maximum(np.square(others).sum(axes, keepdims=True), 1e-12)
    return np.asarray(own - slope.clip(0.0, 1.0) * others, np.float32).reshape(advantage.shape)
