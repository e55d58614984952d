"""Mean actions of policies in NumPy, as fast as torch without its memory use in every worker, and the history H_t."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array, Indices

Activation = Callable[[Array], Array]


def elu(x: Array) -> Array:
    """x where it is positive, else exp(x) - 1."""
    below = np.expm1(np.minimum(x, 0.0))
    below += np.maximum(x, 0.0)
    return below


ACTIVATIONS: Mapping[str, Activation] = {"elu": elu, "relu": lambda x: np.maximum(x, 0.0), "tanh": np.tanh}
"""Activations by their name in a recipe."""


@dataclass(frozen=True)
class Linear:
    """x · weight + bias: (inputs, outputs) and (outputs,), float32."""

    weight: Array
    bias: Array

    def __call__(self, x: Array) -> Array:
        y: Array = x @ self.weight
        y += self.bias
        return y


@dataclass(frozen=True)
class Layers:
    """Linear layers with an activation between them. A mirror-symmetric network is one with tied weights."""

    layers: tuple[Linear, ...]
    activation: str

    def __call__(self, x: Array) -> Array:
        activate = ACTIVATIONS[self.activation]
        *hidden, last = self.layers
        for layer in hidden:
            x = activate(layer(x))
        return last(x)


@dataclass(frozen=True)
class Normal:
    """(x - mean) / std, clipped."""

    mean: Array
    std: Array
    clip: float

    def __call__(self, x: Array) -> Array:
        y: Array = x - self.mean
        y /= self.std
        return np.clip(y, -self.clip, self.clip, out=y)


@dataclass(frozen=True)
class HistoryEncoder:
    """Normalised history, (..., n, K, S), oldest first, to latent, (..., n, latent): one layer shared by all
    observations, then one layer on all their features."""

    frame: Linear
    whole: Linear
    activation: str
    mirror: tuple[Indices, Array] | None = None
    """Permutation and sign that mirror an observation, if the latent encodes the history and its mirror image."""

    def __call__(self, history: Array) -> Array:
        if self.mirror is None:
            return self._encoded(history)
        permutation, sign = self.mirror
        return np.concatenate([self._encoded(history), self._encoded(history[..., permutation] * sign)], axis=-1)

    def _encoded(self, history: Array) -> Array:
        activate = ACTIVATIONS[self.activation]
        *outer, rows, moments, size = history.shape
        frames = activate(self.frame(history.reshape(*outer, rows * moments, size)))
        return activate(self.whole(frames.reshape(*outer, rows, -1)))


@dataclass(frozen=True)
class RowPolicy:
    """Policy of the newest row: (..., n, S + P) to (..., n, A)."""

    normal: Normal
    body: Layers

    def __call__(self, rows: Array) -> Array:
        return self.body(self.normal(rows))


@dataclass(frozen=True)
class HistoryPolicy:
    """Policy of the history H_t, such as a student: (..., n, K, S), oldest first, to (..., n, A)."""

    normal: Normal
    encoder: HistoryEncoder
    estimate: Linear | None
    """Layer that estimates s_priv from the latent, if the body receives s_priv."""
    body: Layers

    def __call__(self, history: Array) -> Array:
        seen = self.normal(history)
        latent = self.encoder(seen)
        read = latent if self.estimate is None else self.estimate(latent)
        return self.body(np.concatenate([seen[..., -1, :], read], axis=-1))


class History:
    """The last K observations of n environments, (n, K, S), oldest first; an episode begins with K times its first."""

    def __init__(self, environments: int, length: int, observation: int) -> None:
        self.frames: NDArray[np.float32] = np.zeros((environments, length, observation), np.float32)

    def push(self, observation: NDArray[np.float32], starts: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Append s_t, shape (n, S), or refill the history with it where `starts`; returns H_t, shape (n, K, S)."""
        self.frames[:, :-1] = self.frames[:, 1:]
        self.frames[:, -1] = observation
        self.frames[starts] = observation[starts, None]
        return self.frames
