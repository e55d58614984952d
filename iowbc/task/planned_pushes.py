"""Pushes on the base and pulls on the object at set times, for trials of a policy's response."""

from collections.abc import Sequence

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.robot.rotations import turned
from iowbc.task.episodes import PlannedPull, PlannedPush


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
        return in_world(forward, left, heading)


class PlannedPulls:
    """Sinusoidal forces on the objects of n environments."""

    def __init__(self, pulls: Sequence[PlannedPull | None], period: float) -> None:
        """`period`: control period [s]."""
        self.any = any(pull is not None for pull in pulls)
        planned = [pull or PlannedPull(np.inf, 0.0, 1.0, (0.0, 0.0)) for pull in pulls]
        self._begin = np.array([pull.begin for pull in planned])
        self._end = self._begin + np.array([pull.duration for pull in planned])
        self._rate = 2.0 * np.pi * np.array([pull.frequency for pull in planned])
        self._force = np.array([pull.force for pull in planned])
        self._period = period

    def force(self, step: Indices, heading: Array) -> Array:
        """World force in the middle of the period that begins at `step` (n,), (n, 3) [N]; `heading` as of a push."""
        time = (step + 0.5) * self._period
        acting = (time > self._begin) & (time < self._end)
        size = np.where(acting, np.sin(self._rate * np.where(acting, time - self._begin, 0.0)), 0.0)
        forward, left = (self._force * size[:, None]).T
        return in_world(forward, left, heading)


def in_world(forward: Array, left: Array, heading: Array) -> Array:
    """Horizontal vectors of a heading frame as world vectors, (n, 3)."""
    return turned(np.stack([forward, left, np.zeros(len(heading))], axis=1), heading)
