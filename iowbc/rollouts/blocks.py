"""Blocks of environments for which a policy is computed together, the same blocks however many workers there are.

A product of matrices rounds its sums in an order that follows from the shapes. Blocks begin at fixed environments and
workers hold whole blocks, so that what is computed for an environment does not depend on who computes it.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from iowbc.arrays import Array

LARGEST = 4
"""Environments in a block: with four rows the products of a policy take no longer than with all at once (0.35 ms for 48
rows of [512, 256, 128]; with eight 0.5 ms), and few leave no worker with much more than its share."""
FEWEST = 8
"""Blocks that there are at least, as far as environments go: with few environments they are smaller."""


def block_size(environments: int) -> int:
    """Environments in each block but the last one, which may be smaller."""
    return max(1, min(LARGEST, environments // FEWEST))


def shares_in_blocks(environments: int, parts: int) -> list[tuple[int, int]]:
    """First and last environment (excluded) of nearly equal groups of whole blocks, as many as there are blocks for."""
    size = block_size(environments)
    blocks = -(-environments // size)
    parts = min(parts, blocks)
    ends = [min(round(part * blocks / parts) * size, environments) for part in range(parts + 1)]
    return list(pairwise(ends))


def in_blocks(function: Callable[[Array], Array], size: int, x: Array) -> Array:
    """A function of stacked blocks, (blocks, size, ...) to (blocks, size, k), for rows (n, ...), of which the first
    begins a block: (n, k)."""
    whole = len(x) // size * size
    parts = [x[:whole].reshape(-1, size, *x.shape[1:])] if whole else []
    if whole < len(x):
        parts.append(x[None, whole:])
    found = [function(part) for part in parts]
    return np.concatenate([part.reshape(-1, part.shape[-1]) for part in found])
