"""Jumps of the reference for a small step of the command."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.control.feasible_map import FeasibleMap
from iowbc.control.generator import ReferenceNetwork
from iowbc.recipe.generator import ReferenceGenerator


@dataclass(frozen=True)
class Jumps:
    """Largest joint move for one step on each line, shape (lines,) [rad], and where it was."""

    largest: Array
    command: Array
    """Height [m] and pitch [rad] after that step, shape (lines, 2)."""


def measure_jumps(
    network: ReferenceNetwork, recipe: ReferenceGenerator, feasible: FeasibleMap, arm: Array, seed: int
) -> Jumps:
    """Walks random lines between feasible commands; line i keeps the arms arm[i % n].

    A step is one step of the height, one of the pitch, or a mixture of parts of both that add up to one. Steps outside
    the map, which need not be convex, do not count.
    """
    generator, smooth = np.random.default_rng(seed), recipe.fit.smoothness
    largest, where = np.empty(smooth.lines), np.empty((smooth.lines, 2))
    for line in range(smooth.lines):
        pitch = generator.uniform(feasible.pitch[0], feasible.pitch[-1], 2)
        low, high = np.interp(pitch, feasible.pitch, feasible.low), np.interp(pitch, feasible.pitch, feasible.high)
        height = generator.uniform(low, high)
        steps = abs(np.diff(height)[0]) / smooth.height_step + abs(np.diff(pitch)[0]) / smooth.pitch_step
        along = np.append(np.arange(0.0, steps) / max(steps, 1e-9), 1.0)
        command = np.empty((len(along), 2))
        command[:, 0] = height[0] + along * (height[1] - height[0])
        command[:, 1] = pitch[0] + along * (pitch[1] - pitch[0])
        inside = feasible.contains(command[:, 0], command[:, 1])
        arms = np.repeat(arm[line % len(arm)][None], len(along), axis=0)
        reference = network(arms, command)
        moved = np.abs(np.diff(reference, axis=0)).max(axis=1) * (inside[1:] & inside[:-1])
        worst = int(np.argmax(moved))
        largest[line], where[line] = moved[worst], command[worst + 1]
    return Jumps(largest, where)
