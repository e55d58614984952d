"""The curriculum: difficulty at the levels of its axes, results of episodes, and the levels that follow from them."""

from typing import TYPE_CHECKING

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.recipe.task.curriculum import Ceilings, Curriculum
from iowbc.robot.rotations import TINY

if TYPE_CHECKING:
    from iowbc.task.episode_state import EpisodeState
    from iowbc.task.judge import Ending

AXES = ("posture", "locomotion", "load", "disturbance")
"""Columns of the levels."""
POSTURE, LOCOMOTION, LOAD, DISTURBANCE = range(len(AXES))
SCALES = {
    **dict.fromkeys(("velocity", "turning"), LOCOMOTION),
    "posture": POSTURE,
    **dict.fromkeys(("load", "resistance", "blocked"), LOAD),
    "disturbance": DISTURBANCE,
}
"""Scales of `iowbc.recipe.task.curriculum.Curriculum`, and the axis on whose level each depends."""
FULL_RANGE_LEVEL = 1.0
"""Level at which the recipe's ranges are used in full; above it commands and loads may be infeasible."""
ROUNDING = 1e-9
"""Tolerance for comparing levels, which are sums of rises."""


def initial_levels(curriculum: Curriculum, n: int) -> Array:
    """Levels at the start, (n, axes)."""
    return np.full((n, len(AXES)), 0.0 if curriculum.enabled else curriculum.fixed_level)


def played_levels(curriculum: Curriculum, levels: Array, walking: Mask) -> Array:
    """Effective levels of an episode, (n, axes): if it walks, none exceeds that of locomotion by more than `lead`."""
    most = levels[:, LOCOMOTION] + curriculum.lead
    held_back: Array = np.where(walking[:, None], np.minimum(levels, most[:, None]), levels)
    held_back[:, LOCOMOTION] = levels[:, LOCOMOTION]
    return held_back if curriculum.enabled else levels.copy()


def difficulty(curriculum: Curriculum, played: Array) -> dict[str, Array]:
    """The scales at levels (n, axes), by name in `SCALES`, (n,)."""
    scales = {name: getattr(curriculum, name) for name in SCALES}
    return {
        name: np.interp(played[:, SCALES[name]], (0.0, 1.0, 2.0), (scale.start, scale.full, scale.extreme))
        for name, scale in scales.items()
    }


def phase(curriculum: Curriculum, levels: Array) -> Array:
    """Phase of each environment, 1 to 3, (n,): all ceilings of the earlier phases have been reached."""
    first = _reached(curriculum.balance, levels, curriculum.limit)
    second = first & _reached(curriculum.locomotion, levels, curriculum.limit)
    return 1 + first.astype(np.int64) + second


class EpisodeOutcome:
    """Results of the episodes of n environments, each (n,); valid where an episode ends in this step."""

    def __init__(self, memory: "EpisodeState", ending: "Ending", period: float, blame: float) -> None:
        """`blame`: time for which a disturbance counts as recent [s]."""
        steps = np.maximum(memory.steps, 1)
        moved = memory.commanded > TINY
        self.survived = ending.truncated
        """Reached the time limit."""
        self.progress_in_time = memory.steps / memory.limit
        """Fraction of the time limit that was reached."""
        self.posture = memory.tracking.min(axis=1) / steps
        """The worse of the mean scores of height and pitch, 0 to 1."""
        self.walked = memory.walked * period
        """Time with a commanded velocity [s]."""
        self.covered = np.where(moved, memory.covered / np.maximum(memory.commanded, TINY), 1.0)
        """Fraction of the commanded displacement that was covered; 1 if none was commanded."""
        self.heading = memory.heading_error / steps
        """Mean heading error [rad]."""
        self.infeasible = memory.infeasible.copy()
        """The crate's rolling resistance exceeded the friction of the feet."""
        self.stepping = memory.stepping.copy()
        """The gait clock was running at the end."""
        self.lagged = ending.lagging
        """Ended because it lagged behind the command."""
        self.disturbed = memory.undisturbed * period <= blame
        """An impulse or a push acted shortly before the end."""


def next_levels(curriculum: Curriculum, levels: Array, played: Array, outcome: EpisodeOutcome) -> Array:
    """Levels after an episode, (n, axes). An axis whose effective level was capped keeps its level."""
    if not curriculum.enabled:
        return levels
    own = played >= levels - ROUNDING
    moved = levels + curriculum.rise * (_success(curriculum, played, outcome) & own)
    moved -= curriculum.fall * (_failure(curriculum, played, outcome) & own)
    ceilings = np.stack([_row(each) for each in (curriculum.balance, curriculum.locomotion, curriculum.extreme)])
    ceiling = np.minimum(ceilings[phase(curriculum, levels) - 1], curriculum.limit)
    return np.clip(moved, 0.0, np.maximum(ceiling, levels))


def _success(curriculum: Curriculum, played: Array, outcome: EpisodeOutcome) -> Mask:
    steady = outcome.survived & (outcome.posture >= curriculum.tracking)
    walked = outcome.walked >= curriculum.least_walk
    there = (outcome.covered >= curriculum.progress) & (outcome.heading <= curriculum.heading)
    beyond = outcome.infeasible | (played[:, LOCOMOTION] > FULL_RANGE_LEVEL + ROUNDING)
    success = np.repeat(steady[:, None], len(AXES), axis=1)
    carried = ~walked | outcome.infeasible | (outcome.covered >= curriculum.load_progress)
    success[:, LOAD] &= carried
    success[:, LOCOMOTION] = walked & outcome.survived & np.where(beyond, steady, there)
    return success


def _failure(curriculum: Curriculum, played: Array, outcome: EpisodeOutcome) -> Mask:
    ended = ~outcome.survived & (outcome.progress_in_time < curriculum.early)
    walking = outcome.stepping | outcome.lagged
    pushed = outcome.disturbed & (played[:, DISTURBANCE] > 0.0) & ~outcome.lagged
    statue = outcome.survived & (outcome.walked >= curriculum.least_walk) & (outcome.covered < curriculum.lagging)
    failure = np.zeros(played.shape, np.bool_)
    failure[:, DISTURBANCE] = ended & pushed
    statue &= ~outcome.infeasible & (played[:, LOCOMOTION] <= FULL_RANGE_LEVEL)
    failure[:, LOCOMOTION] = (ended & walking & ~pushed) | statue
    failure[:, POSTURE] = failure[:, LOAD] = ended & ~walking & ~pushed
    return failure


def _row(ceilings: Ceilings) -> Array:
    return np.array([getattr(ceilings, axis) for axis in AXES])


def _reached(ceilings: Ceilings, levels: Array, limit: float) -> Mask:
    return np.all(levels >= np.minimum(_row(ceilings), limit) - ROUNDING, axis=1)
