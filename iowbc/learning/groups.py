"""Groups of environments that share their state and random quantities, and advantages without what they have in common.

Most of an advantage's variance does not come from the actions but from disturbances, noise and the critic's errors.
Environments that begin a rollout in one state, with the same random quantities (common random numbers), share it. The
mean of the others estimates it without bias, since it does not depend on the action of the environment itself.
"""

import numpy as np
import torch
from numpy.typing import NDArray

from iowbc.arrays import Array, Mask


def drawn_leaders(environments: int, group: int) -> NDArray[np.int64]:
    """For each environment, the one of its group, at random, from whose state the group begins, (n,)."""
    chosen = torch.randint(group, (environments // group,)).numpy() + group * np.arange(environments // group)
    return np.repeat(chosen, group)


def without_common_part(advantage: Array, ended: Mask, group: int) -> Array:
    """Advantages (T, n) less the mean of the others in the group, times the coefficient of least squares of the step.

    `ended`: where an episode ended with the step, (T, n); from then on an environment is on its own.
    """
    own = advantage.reshape(len(advantage), -1, group)
    together = np.ones_like(own)
    together[1:] = np.cumsum(ended, axis=0)[:-1].reshape(own[1:].shape) == 0
    total, number = (own * together).sum(-1, keepdims=True), together.sum(-1, keepdims=True)
    others = together * (total - own) / np.maximum(number - 1.0, 1.0) * (number > 1.0)
    axes = (1, 2)
    slope = (others * own).sum(axes, keepdims=True) / np.maximum(np.square(others).sum(axes, keepdims=True), 1e-12)
    return np.asarray(own - slope.clip(0.0, 1.0) * others, np.float32).reshape(advantage.shape)
