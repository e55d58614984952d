"""Mean actions of policies, in NumPy."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.rollouts.encoders import Encoder
from iowbc.rollouts.perceptron import Linear, Normal, Perceptron


@dataclass(frozen=True)
class RowPolicy:
    """Of the newest row, (..., n, S + P) to (..., n, A)."""

    normal: Normal
    body: Perceptron

    def __call__(self, rows: Array) -> Array:
        return self.body(self.normal(rows))


@dataclass(frozen=True)
class HistoryPolicy:
    """Of the history H_t, (..., n, K, S), oldest first, to (..., n, A): a student."""

    normal: Normal
    encoder: Encoder
    estimate: Linear | None
    """Reads s_priv from the latent, where the body is to see that."""
    body: Perceptron

    def __call__(self, history: Array) -> Array:
        seen = self.normal(history)
        latent = self.encoder(seen)
        told = latent if self.estimate is None else self.estimate(latent)
        return self.body(np.concatenate([seen[..., -1, :], told], axis=-1))
