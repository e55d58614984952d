"""Pushes on the base at set times, for trials that ask how much a policy withstands."""

from collections.abc import Sequence

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.task.episodes import PlannedPush


class PlannedPushes:
    """Forces on the bases of n environments over the control periods of their pushes."""

    def __init__(self, pushes: Sequence[PlannedPush | None], period: float) -> None:
        """`period`: control period [s]."""
        self.any = any(push is not None for push in pushes)
        planned = [push or PlannedPush(np.inf, period, (0.0, 0.0)) for push in pushes]
        length = np.array([max(1, round(push.duration / period)) for push in planned])
        self._first = np.array([np.round(push.time / period) for push in planned])
        self._last = self._first + length
        self._strength = np.array([push.impulse for push in planned]) / (length * period)[:, None]

    def force(self, step: Indices, heading: Array) -> Array:
        """World force over the period that begins at `step` (n,), (n, 3) [N]; `heading`: commanded, (n,) [rad]."""
        forward, left = (self._strength * ((step >= self._first) & (step < self._last))[:, None]).T
        cosine, sine = np.cos(heading), np.sin(heading)
        return np.stack([cosine * forward - sine * left, sine * forward + cosine * left, np.zeros(len(step))], axis=1)
