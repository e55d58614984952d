"""Measures which (height, pitch) can be held: the grid labelled with the default arms, and the share kept with other arms."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.reference.dataset import Dataset
from iowbc.reference.feasibility import FeasibleMap, build_map
from iowbc.reference.sampling import SamplePlan

Array = NDArray[Any]

ARMS_COLLIDE = "arms collide"
"""A reason that says nothing of height and pitch."""


@dataclass(frozen=True)
class Region:
    """The map and what it was made from, on the grid (pitches, heights)."""

    map: FeasibleMap
    nominal: NDArray[np.bool_]
    """Whether the default arms have a label."""
    share: Array
    """Share of samples with other arms that were kept; -1 where there were too few."""


def measure_region(plan: SamplePlan, dataset: Dataset) -> Region:
    """The feasible map. Raises ValueError when it is empty."""
    recipe = plan.recipe.feasible
    shape = (len(plan.pitches), len(plan.heights))
    nominal = np.zeros(shape, dtype=bool)
    grid = dataset.index[dataset.index >= plan.drawn] - plan.drawn
    nominal.ravel()[grid] = True
    told = dataset.rejected_reason != ARMS_COLLIDE
    kept = _count(plan, dataset.command[dataset.index < plan.drawn])
    tried = kept + _count(plan, dataset.rejected_command[told & (dataset.rejected_index < plan.drawn)])
    enough = tried >= recipe.cell_samples
    share = np.where(enough, kept / np.maximum(tried, 1), -1.0)
    feasible = nominal & (~enough | (share >= recipe.kept_share))
    return Region(build_map(plan.pitches, plan.heights, feasible), nominal, share)


def _count(plan: SamplePlan, command: Array) -> Array:
    """Commands in the cell around each grid point, shape (pitches, heights)."""
    counts, _, _ = np.histogram2d(command[:, 1], command[:, 0], bins=[_edges(plan.pitches), _edges(plan.heights)])
    return counts


def _edges(centres: Array) -> Array:
    half = 0.5 * (centres[1] - centres[0]) if len(centres) > 1 else 0.5
    return np.append(centres - half, centres[-1] + half)
