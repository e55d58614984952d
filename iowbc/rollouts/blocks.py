"""Blocks of environments that share one policy evaluation, independent of the number of workers.

The rounding of a matrix product depends on its shape. Blocks start at fixed environments and workers hold whole blocks,
so that the result for an environment does not depend on the worker.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from iowbc.arrays import Array

LARGEST = 4
"""Most environments in a block. Blocks of four take no longer than all rows at once (0.35 ms for 48 rows of
[512, 256, 128]; 0.5 ms with blocks of eight), and small blocks balance the load of the workers."""
FEWEST = 8
"""Fewest blocks: with few environments, blocks are smaller, down to one environment."""


def block_size(environments: int) -> int:
    """Environments per block; the last block may be smaller."""
    return max(1, min(LARGEST, environments // FEWEST))


def shares_in_blocks(environments: int, parts: int, size: int | None = None) -> list[tuple[int, int]]:
    """First and last environment (excluded) of at most `parts` nearly equal groups of whole blocks of a `size`."""
    size = size or block_size(environments)
    blocks = -(-environments // size)
    parts = min(parts, blocks)
    ends = [min(round(part * blocks / parts) * size, environments) for part in range(parts + 1)]
    return list(pairwise(ends))


def in_blocks(function: Callable[[Array], Array], size: int, x: Array) -> Array:
    """Apply a function of stacked blocks, (blocks, size, ...) to (blocks, size, k), to rows (n, ...); returns (n, k).
    The first row starts a block."""
    whole = len(x) // size * size
    parts = [x[:whole].reshape(-1, size, *x.shape[1:])] if whole else []
    if whole < len(x):
        parts.append(x[None, whole:])
    found = [function(part) for part in parts]
    return np.concatenate([part.reshape(-1, part.shape[-1]) for part in found])
