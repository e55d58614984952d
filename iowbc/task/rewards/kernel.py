"""The kernel of tracking rewards."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]


def kernel(squared_error: Array, width: float) -> Array:
    """exp(−e²/width²), (n,): 1 without error, 0.37 at an error of `width`."""
    score: Array = np.exp(-squared_error / width**2)
    return score


def squared_norm(values: Array) -> Array:
    """Sum of squares over all axes but the first, (n, ...) to (n,)."""
    flat = values.reshape(len(values), -1)
    total: Array = np.square(flat).sum(axis=1)
    return total
