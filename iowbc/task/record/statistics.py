"""Training statistics computed from the counters of the environments."""

from collections.abc import Sequence

import numpy as np

from iowbc.arrays import Array
from iowbc.task.curriculum import AXES
from iowbc.task.record.signals import CAUSES, COUNTERS, ERRORS, KINDS, REASONS

EPISODIC = (
    *("episode_seconds", "episode_return"),
    *(f"terminations/{reason}" for reason in REASONS),
    *(f"falls/{cause}" for cause in CAUSES),
)
"""Statistics of finished episodes; if none finished, the last values are kept."""


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
        """Statistics from counters (n, len(COUNTERS)), sums of reward terms (n, terms) and levels (n, axes); resets
        counters and sums to zero.

        Rewards are means per second, terminations and falls fractions of the episodes that ended, divergences a count,
        errors means of absolute values by scene and kind of command.
        """
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
        first = COUNTERS.index(f"{KINDS[0]}/steps")
        for place, rows in enumerate(self._scenes.values()):
            sums = counters[rows, first:].sum(axis=0).reshape(len(KINDS), 1 + len(ERRORS))
            stepped = sums[:, 0] > 0.0
            kept[place, stepped] = sums[stepped, 1:] / sums[stepped, :1]
