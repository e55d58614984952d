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
    """Whether it has one that moves no more than allowed from the height below."""
    share: Array
    """Share of the samples around a command that have a label; -1 where there were too few."""


def measure_region(plan: SamplePlan, dataset: Dataset) -> Region:
    """The feasible map. Raises ValueError when it is empty."""
    recipe = plan.recipe.feasible
    posture = np.zeros((*plan.grid_shape, dataset.support.shape[1]))
    labelled = np.zeros(plan.grid_shape, dtype=bool)
    on_grid = dataset.index >= plan.drawn
    cells = dataset.index[on_grid] - plan.drawn
    posture.reshape(-1, posture.shape[-1])[cells] = dataset.support[on_grid]
    labelled.ravel()[cells] = True
    climb = np.abs(np.diff(posture, axis=2)).max(axis=-1)
    steep = np.zeros_like(labelled)
    steep[..., 1:] = labelled[..., 1:] & labelled[..., :-1] & (climb > recipe.steepest * np.diff(plan.heights))
    told = dataset.rejected_reason != ARMS_COLLIDE
    kept = _around(plan, dataset.command[~on_grid])
    tried = kept + _around(plan, dataset.rejected_command[told & (dataset.rejected_index < plan.drawn)])
    enough = tried >= recipe.enough
    share = np.where(enough, kept / np.maximum(tried, 1), -1.0)
    held: NDArray[np.bool_] = np.any(labelled, axis=0, keepdims=False)
    gentle: NDArray[np.bool_] = np.any(labelled & ~steep, axis=0, keepdims=False)
    feasible = gentle & (~enough | (share >= recipe.kept_share))
    return Region(build_map(plan.pitches, plan.heights, feasible, recipe.bound_slope), held, gentle, share)


def _around(plan: SamplePlan, command: Array) -> Array:
    """Number of commands (n, 4) within the window of each grid point, shape (pitches, heights)."""
    height, pitch = plan.recipe.feasible.window
    near_pitch = np.abs(command[:, 1] - plan.pitches[:, None]) <= pitch
    near_height = np.abs(command[:, 0] - plan.heights[:, None]) <= height
    return near_pitch.astype(np.float64) @ near_height.T.astype(np.float64)
