"""Array types of arguments and results, indices as slices, and code shared by NumPy and torch."""

import copy
import sys
from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""Numbers; shape, unit and frame stand with each argument."""
Indices = NDArray[np.int64]
"""Places along an axis."""
Mask = NDArray[np.bool_]
"""True for the selected elements."""
Keys = NDArray[np.uint64]
"""Keys of counter-based random numbers."""


def as_slice(indices: Indices) -> slice | Indices:
    """Evenly spaced indices as a slice, which NumPy views without a copy and copies several times faster."""
    steps = np.unique(np.diff(indices)) if len(indices) > 1 else np.ones(1, np.int64)
    if not len(indices) or len(steps) != 1 or steps[0] < 1:
        return indices
    return slice(int(indices[0]), int(indices[-1]) + 1, int(steps[0]))


def places(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Places of named parts that follow one another, from their sizes."""
    ends = accumulate(sizes.values())
    return {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}


def namespace(array: Any) -> Any:
    """The module of array functions: NumPy, or torch for a tensor, as in an equation that is being exported.

    Both have `concatenate`, `stack`, `where`, `swapaxes` and the elementwise functions by these names.
    """
    return np if isinstance(array, np.ndarray | np.generic) else sys.modules["torch"]


def stacked(parts: Sequence[Any]) -> Any:
    """Arrays or tensors of one shape along a new first axis; of few rows, NumPy's own `stack` takes twice the time."""
    return np.array(parts) if isinstance(parts[0], np.ndarray) else sys.modules["torch"].stack(parts)


class Constants:
    """An object that holds constants only: its arrays may be of another kind."""

    def converted(self, convert: Callable[[Array], Any]) -> Self:
        """A copy with every floating-point array converted, also in nested `Constants`."""
        other = copy.copy(self)
        for name, value in vars(self).items():
            object.__setattr__(other, name, _converted(value, convert))
        return other


def _converted(value: Any, convert: Callable[[Array], Any]) -> Any:
    if isinstance(value, Constants):
        return value.converted(convert)
    if isinstance(value, tuple):
        return tuple(_converted(each, convert) for each in value)
    if isinstance(value, np.ndarray) and np.issubdtype(value.dtype, np.floating):
        return convert(value)
    return value
