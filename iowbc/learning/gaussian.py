"""Diagonal Gaussians over actions."""

import math

import torch
from torch import Tensor

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
