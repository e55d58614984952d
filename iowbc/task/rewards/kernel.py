"""The kernel of tracking rewards."""

import numpy as np

from iowbc.arrays import Array


def kernel(squared_error: Array, width: float | Array) -> Array:
    """exp(−e²/width²), (n,) or (n, k): 1 without error, 0.37 at an error of `width`, one or (k,)."""
    return np.exp(squared_error / -(width * width))


def squared_norm(values: Array) -> Array:
    """Sum of squares over all axes but the first, (n, ...) to (n,)."""
    flat = values.reshape(len(values), -1)
    return np.vecdot(flat, flat)
