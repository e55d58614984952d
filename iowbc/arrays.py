"""The kinds of array that functions take and give, and indices as slices."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""Numbers; shape, unit and frame stand with each argument."""
Indices = NDArray[np.int64]
"""Places along an axis."""
Mask = NDArray[np.bool_]
"""True for those that are meant."""
Keys = NDArray[np.uint64]
"""Keys of counter-based random numbers."""


def as_slice(indices: Indices) -> slice | Indices:
    """Indices at equal distances as a slice, of which NumPy takes views and which it copies several times faster."""
    steps = np.unique(np.diff(indices)) if len(indices) > 1 else np.ones(1, np.int64)
    if not len(indices) or len(steps) != 1 or steps[0] < 1:
        return indices
    return slice(int(indices[0]), int(indices[-1]) + 1, int(steps[0]))
