"""Encoders of a history in NumPy: (..., n, K, S) normalised, oldest first, to a latent (..., n, latent).

Each observation is projected by the same layer first; `iowbc.learning.encoders` says what comes then.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.rollouts.perceptron import ACTIVATIONS, Linear

Encoder = Callable[[Array], Array]


def along_time(layer: Linear, x: Array) -> Array:
    """A layer of each moment, (..., n, K, S) to (..., n, K, F), as one product for all n."""
    *outer, rows, moments, size = x.shape
    return layer(x.reshape(*outer, rows * moments, size)).reshape(*outer, rows, moments, -1)


@dataclass(frozen=True)
class Whole:
    """All projections at once."""

    frame: Linear
    whole: Linear
    activation: str

    def __call__(self, history: Array) -> Array:
        activate = ACTIVATIONS[self.activation]
        frames = activate(along_time(self.frame, history))
        return activate(self.whole(frames.reshape(*frames.shape[:-2], -1)))


@dataclass(frozen=True)
class Convolutional:
    """Convolutions along time, each of which halves the length."""

    frame: Linear
    time: tuple[Linear, ...]
    """Of windows of moments, (kernel · F, F)."""
    kernel: int
    stride: int
    whole: Linear
    activation: str

    def __call__(self, history: Array) -> Array:
        activate = ACTIVATIONS[self.activation]
        x = activate(along_time(self.frame, history))
        around = [(0, 0)] * (x.ndim - 2) + [(self.kernel // 2, self.kernel // 2), (0, 0)]
        for layer in self.time:
            length = -(-x.shape[-2] // self.stride)
            places = self.stride * np.arange(length)[:, None] + np.arange(self.kernel)
            windows = np.pad(x, around)[..., places, :]
            x = activate(along_time(layer, windows.reshape(*windows.shape[:-2], -1)))
        return activate(self.whole(x.reshape(*x.shape[:-2], -1)))


@dataclass(frozen=True)
class Recurrent:
    """A gated recurrent unit (Cho et al. 2014, as torch has it), the moments in order."""

    frame: Linear
    given: Linear
    """Of the projection, (F, 3 · latent): for the reset gate, the update gate and the candidate."""
    kept: Linear
    """Of the state, (latent, 3 · latent)."""
    activation: str

    def __call__(self, history: Array) -> Array:
        given = along_time(self.given, ACTIVATIONS[self.activation](along_time(self.frame, history)))
        state = np.zeros((*given.shape[:-2], given.shape[-1] // 3), np.float32)
        for moment in range(given.shape[-2]):
            reset, update, candidate = np.split(given[..., moment, :], 3, axis=-1)
            own_reset, own_update, own_candidate = np.split(self.kept(state), 3, axis=-1)
            fresh = np.tanh(candidate + _gate(reset + own_reset) * own_candidate)
            state = fresh + _gate(update + own_update) * (state - fresh)
        return state


def _gate(x: Array) -> Array:
    """1 / (1 + exp(-x)), of which the exponential never overflows."""
    half = np.float32(0.5)
    gate: Array = half + half * np.tanh(half * x)
    return gate


@dataclass(frozen=True)
class Mirrored:
    """An encoder of a history and of its mirror image, side by side."""

    encoder: Encoder
    permutation: Indices
    sign: Array

    def __call__(self, history: Array) -> Array:
        image = history[..., self.permutation] * self.sign
        return np.concatenate([self.encoder(history), self.encoder(image)], axis=-1)
