"""Layers in NumPy on stacks of rows, (..., rows, features): as fast as torch's, without its memory in every worker."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array

Activation = Callable[[Array], Array]


def elu(x: Array) -> Array:
    """x where it is positive, else exp(x) - 1."""
    below = np.expm1(np.minimum(x, 0.0))
    below += np.maximum(x, 0.0)
    return below


def relu(x: Array) -> Array:
    """x where it is positive, else 0."""
    return np.maximum(x, 0.0)


ACTIVATIONS: Mapping[str, Activation] = {"elu": elu, "relu": relu, "tanh": np.tanh}
"""By their name in a recipe."""


@dataclass(frozen=True)
class Linear:
    """x · weight + bias."""

    weight: Array
    """(inputs, outputs), float32."""
    bias: Array
    """(outputs,), float32."""

    def __call__(self, x: Array) -> Array:
        y: Array = x @ self.weight
        y += self.bias
        return y


@dataclass(frozen=True)
class Perceptron:
    """Linear layers with an activation between them; a network that commutes with a mirror is one with tied weights."""

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
