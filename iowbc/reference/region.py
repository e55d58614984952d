"""Feasible (height, pitch) region: by labels on and around a grid, and by smoothness of the fitted network."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.feasible_map import FeasibleMap, build_map
from iowbc.control.generator import ReferenceNetwork
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.plan import SamplePlan


@dataclass(frozen=True)
class LabelledRegion:
    """Map of the commands with labels, and its data on the grid (pitches, heights)."""

    map: FeasibleMap
    held: Mask
    """True where one of the grid's two arm postures has a label."""
    share: Array
    """Fraction of the samples around a command that have a label; -1 for too few samples."""


def measure_labelled_region(plan: SamplePlan, dataset: Dataset) -> LabelledRegion:
    """Map of the commands that have labels. Raises ValueError if it is empty."""
    recipe = plan.recipe.feasible
    on_grid = dataset.index >= plan.drawn
    found = np.zeros(plan.grid_shape, dtype=bool)
    found.ravel()[dataset.index[on_grid] - plan.drawn] = True
    held: Mask = np.any(found, axis=0, keepdims=False)
    relevant = dataset.rejected_reason != "arms collide"  # which does not depend on height and pitch
    kept = _around(plan, dataset.command[~on_grid])
    tried = kept + _around(plan, dataset.rejected_command[relevant & (dataset.rejected_index < plan.drawn)])
    enough = tried >= recipe.enough
    share = np.where(enough, kept / np.maximum(tried, 1), -1.0)
    feasible = held & (~enough | (share >= recipe.kept_share))
    outline = build_map(plan.pitches, plan.heights, feasible, recipe.bound_slope, plan.nominal)
    return LabelledRegion(outline, held, share)


def measure_smooth_region(
    plan: SamplePlan, held: FeasibleMap, network: ReferenceNetwork, arms: Array
) -> tuple[FeasibleMap, Array]:
    """Part of a map where the network moves smoothly, and the largest joint move for one step at each command of the
    grid (pitches, heights): its quantile `gentle_share` over arms (n, 14) [rad]. Raises ValueError if it is empty."""
    recipe, smooth = plan.recipe.feasible, plan.recipe.fit.smoothness
    arms = arms[np.linspace(0, len(arms) - 1, min(recipe.arms, len(arms))).astype(int)]
    jump = np.empty((len(plan.pitches), len(plan.heights)))

    def reference(height: float, pitch: float) -> Array:
        return network(arms, np.tile([height, pitch], (len(arms), 1)))

    for row, pitch in enumerate(plan.pitches):
        for column, height in enumerate(plan.heights):
            here = reference(height, pitch)
            lower = np.abs(reference(height - smooth.height_step, pitch) - here).max(axis=1)
            leaner = np.abs(reference(height, pitch - smooth.pitch_step) - here).max(axis=1)
            jump[row, column] = np.quantile(np.maximum(lower, leaner), recipe.gentle_share)
    height, pitch = np.meshgrid(plan.heights, plan.pitches)
    feasible = held.contains(height, pitch) & (jump <= recipe.jump)
    return build_map(plan.pitches, plan.heights, feasible, recipe.bound_slope, plan.nominal), jump


def _around(plan: SamplePlan, command: Array) -> Array:
    """Number of commands (n, 2) within the window of each grid point, shape (pitches, heights)."""
    height, pitch = plan.recipe.feasible.window
    near_pitch = np.abs(command[:, 1] - plan.pitches[:, None]) <= pitch
    near_height = np.abs(command[:, 0] - plan.heights[:, None]) <= height
    return near_pitch.astype(np.float64) @ near_height.T.astype(np.float64)
