"""Measures which (height, pitch) can be held: with two arm postures on a grid, and as a share of all arms around it."""

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
    held: NDArray[np.bool_]
    """Whether one of the grid's two arm postures has a label."""
    gentle: NDArray[np.bool_]
    """Whether that label and nearly all around it are less steep than the recipe allows."""
    share: Array
    """Share of the samples around a command that have a label; -1 where there were too few."""


def measure_region(plan: SamplePlan, dataset: Dataset) -> Region:
    """The feasible map. Raises ValueError when it is empty."""
    recipe = plan.recipe.feasible
    on_grid, flat = dataset.index >= plan.drawn, dataset.slope <= recipe.steepest
    held, gentle = (_on_grid(plan, dataset.index[on_grid & which]) for which in (flat | ~flat, flat))
    told = dataset.rejected_reason != ARMS_COLLIDE
    kept = _around(plan, dataset.command[~on_grid])
    tried = kept + _around(plan, dataset.rejected_command[told & (dataset.rejected_index < plan.drawn)])
    enough = tried >= recipe.enough
    share = np.where(enough, kept / np.maximum(tried, 1), -1.0)
    calm = _around(plan, dataset.command[~on_grid & flat]) >= recipe.gentle_share * kept
    feasible = gentle & (~enough | ((share >= recipe.kept_share) & calm))
    return Region(
        build_map(plan.pitches, plan.heights, feasible, recipe.bound_slope), held, gentle & (calm | ~enough), share
    )


def _on_grid(plan: SamplePlan, index: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Grid points (pitches, heights) that have one of these samples, with either arm posture."""
    found = np.zeros(plan.grid_shape, dtype=bool)
    found.ravel()[index - plan.drawn] = True
    either: NDArray[np.bool_] = np.any(found, axis=0, keepdims=False)
    return either


def _around(plan: SamplePlan, command: Array) -> Array:
    """Number of commands (n, 4) within the window of each grid point, shape (pitches, heights)."""
    height, pitch = plan.recipe.feasible.window
    near_pitch = np.abs(command[:, 1] - plan.pitches[:, None]) <= pitch
    near_height = np.abs(command[:, 0] - plan.heights[:, None]) <= height
    return near_pitch.astype(np.float64) @ near_height.T.astype(np.float64)
