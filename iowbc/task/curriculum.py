"""The curriculum: how hard the world is at a level, and how an environment's level moves."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.recipe.task.curriculum import Curriculum


@dataclass(frozen=True)
class Difficulty:
    """The scales of n environments, each (n,); see `iowbc.recipe.task.curriculum.Phase`."""

    velocity: Array
    posture: Array
    load: Array
    disturbance: Array


def difficulty(curriculum: Curriculum, level: Array) -> Difficulty:
    """Scales at levels (n,) in [0, 3], interpolated between the ends of the phases."""
    stops = (curriculum.start, curriculum.balance, curriculum.locomotion, curriculum.extreme)
    knots = np.arange(len(stops))
    return Difficulty(
        **{
            name: np.interp(level, knots, [getattr(stop, name) for stop in stops])
            for name in ("velocity", "posture", "load", "disturbance")
        }
    )


def initial_level(curriculum: Curriculum, n: int) -> Array:
    """Levels at the start, (n,)."""
    return np.full(n, 0.0 if curriculum.enabled else curriculum.fixed_level)


def next_level(curriculum: Curriculum, level: Array, survived: Mask, progress: Array, tracking: Array) -> Array:
    """Levels after an episode, (n,).

    survived: reached its time limit; progress: part of the time limit reached; tracking: the worst of the
    tracked quantities' mean scores.
    """
    if not curriculum.enabled:
        return level
    success = survived & (tracking >= curriculum.tracking)
    failure = ~survived & (progress < curriculum.early)
    moved = level + curriculum.rise * success - curriculum.fall * failure
    clipped: Array = np.clip(moved, 0.0, curriculum.limit)
    return clipped
