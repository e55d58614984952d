"""From the counters of the environments to the figures of a stretch of training."""

import numpy as np

from iowbc.arrays import Array
from iowbc.task.record.signals import COUNTERS, REASONS
from iowbc.task.rewards.table import TERMS

EPISODIC = ("episode_seconds", "episode_return", *(f"terminations/{reason}" for reason in REASONS))
"""Figures of episodes that ended; where none did, the last value is carried on."""


class Statistics:
    """Figures since they were last read; all of them are always there, and finite."""

    def __init__(self, period: float) -> None:
        """`period`: control period [s]."""
        self._period = period
        self.carried = np.zeros(len(EPISODIC))
        """The last values of `EPISODIC`."""

    def read(self, counters: Array, terms: Array, level: Array) -> dict[str, float]:
        """Figures from counters (n, len(COUNTERS)), sums of the reward's terms (n, len(TERMS)) and levels (n,); sets
        counters and sums back.

        Rewards are means per second, terminations parts of the episodes that ended, divergences a number.
        """
        total = dict(zip(COUNTERS, counters.sum(axis=0).tolist(), strict=True))
        rewards = dict(
            zip(TERMS, (terms.sum(axis=0) / (max(total["steps"], 1.0) * self._period)).tolist(), strict=True)
        )
        counters[:], terms[:] = 0.0, 0.0
        if ended := total["episodes"]:
            ways = [total[reason] / ended for reason in REASONS]
            self.carried[:] = [total["length"] / ended * self._period, total["return"] / ended, *ways]
        return {
            "reward": sum(rewards.values()),
            **dict(zip(EPISODIC, self.carried.tolist(), strict=True)),
            "tracking": total["tracking"] / max(total["steps"], 1.0),
            "curriculum_level": float(level.mean()),
            "divergences": total["diverged"],
            **{f"reward/{path}": value for path, value in rewards.items()},
        }
