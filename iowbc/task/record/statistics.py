"""Counters of each step and episode, and the training statistics computed from them."""

from collections.abc import Sequence

import numpy as np

from iowbc.arrays import Array, Indices, Mask
from iowbc.control.command import HEIGHT, PITCH, VELOCITY, YAW_RATE
from iowbc.task.curriculum import AXES
from iowbc.task.episode_state import EpisodeState
from iowbc.task.judge import Ending, Judgement
from iowbc.task.vector.shared import Buffers

REASONS = ("fallen", "dropped", "lagging", "time_limit", "diverged")
"""Reasons for the end of an episode."""
CAUSES = ("walking", "standing", "disturbed")
"""Situations in which a robot falls: walking, standing, or just after a disturbance."""
KINDS = ("standing", "walking")
ERRORS = ("velocity", "heading", "height", "pitch")
"""Tracking errors: the norm of v_sys - v_coll in the plane, filtered [m/s], heading [rad], height [m], pitch [rad]."""
COUNTERS = (
    *("steps", "tracking", "episodes", "length", "return", *REASONS),
    *(f"fell/{cause}" for cause in CAUSES),
    *("pushes", "infeasible"),
    *(f"{kind}/{name}" for kind in KINDS for name in ("steps", *ERRORS)),
)
"""Columns of the statistics: sums since they were last read. Length in steps, errors absolute."""
COLUMN = {name: index for index, name in enumerate(COUNTERS)}
STANDING, WALKING = (slice(COLUMN[f"{kind}/steps"], COLUMN[f"{kind}/{ERRORS[-1]}"] + 1) for kind in KINDS)
"""Columns of steps and errors."""
EPISODIC = (
    *("episode_seconds", "episode_return"),
    *(f"terminations/{reason}" for reason in REASONS),
    *(f"falls/{cause}" for cause in CAUSES),
)
"""Statistics of finished episodes; if none finished, the last values are kept."""


def count_step(buffers: Buffers, judgement: Judgement, memory: EpisodeState) -> None:
    counters, tracking = buffers["counters"], judgement.tracking
    buffers["terms"][:] += judgement.terms
    counters[:, COLUMN["steps"]] += 1.0
    counters[:, COLUMN["tracking"]] += tracking.sum(axis=1) / tracking.shape[1]
    moved, command = judgement.motion, memory.command
    errors = np.empty((len(command), 1 + len(ERRORS)))
    errors[:, 0] = 1.0
    away = memory.filtered_velocity[:, :YAW_RATE] - command[:, :YAW_RATE]
    errors[:, 1] = np.sqrt(np.square(away).sum(axis=1))
    errors[:, 2] = judgement.heading_error
    errors[:, 3] = moved.height - command[:, HEIGHT]
    errors[:, 4] = moved.torso_pitch - command[:, PITCH]
    np.abs(errors, out=errors)
    walking = command[:, VELOCITY].any(axis=1, keepdims=True)
    counters[:, STANDING] += errors * ~walking
    counters[:, WALKING] += errors * walking


def count_endings(buffers: Buffers, ending: Ending, causes: dict[str, Mask], which: Indices) -> None:
    """Adds the episodes that ended, (k,), to the counters; `causes` of falls by name, (n,)."""
    counters = buffers["counters"]
    counters[which, COLUMN["episodes"]] += 1.0
    counters[which, COLUMN["length"]] += buffers["episode_length"][which]
    counters[which, COLUMN["return"]] += buffers["episode_return"][which]
    for cause, found in causes.items():
        counters[which, COLUMN[f"fell/{cause}"]] += found[which]
    for reason, found in ending.reasons().items():
        counters[which, COLUMN[reason]] += found[which]


def count_pushes(buffers: Buffers, pushing: Mask, memory: EpisodeState, which: Indices) -> None:
    """Counts the pushes that begin, (k,), and the infeasible ones; `pushing`: environments with a push scene, (n,)."""
    counters = buffers["counters"]
    counters[which, COLUMN["pushes"]] += pushing[which]
    counters[which, COLUMN["infeasible"]] += memory.infeasible[which]


class Statistics:
    """Statistics since the last read; always complete and finite."""

    def __init__(self, period: float, scenes: Sequence[str], terms: Sequence[str]) -> None:
        """`period`: control period [s]; `scenes`: scene of each environment; `terms`: names of the reward terms."""
        self._period, self._terms = period, tuple(terms)
        names = np.array(scenes)
        self._scenes = {name: names == name for name in dict.fromkeys(scenes)}
        self._kept = len(EPISODIC)
        self._errors = [f"error/{s}/{kind}/{error}" for s in self._scenes for kind in KINDS for error in ERRORS]
        self.carried = np.zeros(self._kept + len(self._errors))
        """Last values of `EPISODIC` and the errors, kept for intervals without data."""

    def read(self, counters: Array, terms: Array, levels: Array) -> dict[str, float]:
        """Statistics from counters (n, len(COUNTERS)), sums of reward terms (n, terms) and levels (n, axes); zeroes the
        first two. Rewards are means per second, terminations and falls fractions of the episodes that ended,
        divergences a count, errors means of absolute values by scene and kind of command."""
        total = dict(zip(COUNTERS, counters.sum(axis=0).tolist(), strict=True))
        steps = max(total["steps"], 1.0)
        rewards = dict(zip(self._terms, (terms.sum(axis=0) / (steps * self._period)).tolist(), strict=True))
        self._carry_errors(counters)
        counters[:], terms[:] = 0.0, 0.0
        if ended := total["episodes"]:
            ways = [total[reason] / ended for reason in (*REASONS, *(f"fell/{cause}" for cause in CAUSES))]
            self.carried[: self._kept] = [total["length"] / ended * self._period, total["return"] / ended, *ways]
        return {
            "reward": sum(rewards.values()),
            **dict(zip((*EPISODIC, *self._errors), self.carried.tolist(), strict=True)),
            "tracking": total["tracking"] / steps,
            "curriculum_level": float(levels.mean()),
            **dict(zip((f"level/{axis}" for axis in AXES), levels.mean(axis=0).tolist(), strict=True)),
            "infeasible_pushes": total["infeasible"] / max(total["pushes"], 1.0),
            "divergences": total["diverged"],
            **{f"reward/{path}": value for path, value in rewards.items()},
        }

    def _carry_errors(self, counters: Array) -> None:
        """Means of the errors of each scene, standing and walking; the last ones where there was no such step."""
        kept = self.carried[self._kept :].reshape(len(self._scenes), len(KINDS), len(ERRORS))
        for place, rows in enumerate(self._scenes.values()):
            sums = counters[rows, STANDING.start :].sum(axis=0).reshape(len(KINDS), 1 + len(ERRORS))
            stepped = sums[:, 0] > 0.0
            kept[place, stepped] = sums[stepped, 1:] / sums[stepped, :1]
