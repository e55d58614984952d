"""Diagonal Gaussians over actions."""

import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from iowbc.robot.mirror import MirrorMap

LOG_TWO_PI = math.log(2.0 * math.pi)


def log_density(actions: Tensor, mean: Tensor, log_std: Tensor) -> Tensor:
    """log N(actions; mean, exp(log_std)²), summed over the action, (n, A) to (n,)."""
    scaled = (actions - mean) * torch.exp(-log_std)
    return -0.5 * (scaled * scaled).sum(-1) - (log_std + 0.5 * LOG_TWO_PI).sum(-1)


def entropy(log_std: Tensor) -> Tensor:
    """Entropy [nat] of the Gaussian."""
    return (log_std + 0.5 + 0.5 * LOG_TWO_PI).sum(-1)


def divergence(mean: Tensor, log_std: Tensor, other_mean: Tensor, other_log_std: Tensor) -> Tensor:
    """D_KL(N(mean, std²) || N(other_mean, other_std²)) in closed form, summed over the action, (n, A) to (n,)."""
    squares = torch.exp(2.0 * log_std) + (mean - other_mean) ** 2
    return (other_log_std - log_std + 0.5 * squares * torch.exp(-2.0 * other_log_std) - 0.5).sum(-1)


def std_places(actions: int, mirror: MirrorMap | None) -> NDArray[np.int64]:
    """Index of each action's standard deviation, (A,); actions that the mirror swaps share one."""
    own = np.arange(actions) if mirror is None else np.minimum(np.arange(actions), mirror.permutation)
    return np.asarray(np.unique(own, return_inverse=True)[1], np.int64)


def exploration(shape: tuple[int, int], log_std: Tensor, correlation: float) -> Tensor:
    """Exploration noise of T steps of n environments, (T, n, A), with exp(log_std) as standard deviation: stationary
    first-order autoregressive noise with this correlation between consecutive steps."""
    found = torch.randn(*shape, len(log_std))
    for step in range(1, len(found)):
        found[step] = correlation * found[step - 1] + math.sqrt(1.0 - correlation**2) * found[step]
    return found * torch.exp(log_std)
