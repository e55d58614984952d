"""Guard of the joint targets that are sent to the motors: rejects non-finite values and jumps."""

import logging
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from iowbc.arrays import Array, Mask

LOG = logging.getLogger(__name__)
JUMP = 2.0
"""Largest change of a target, as a multiple of the joint's velocity limit times the elapsed time. Targets of a PD loop
also set torques: the largest factor in 96 trials was 1.3, and 1 was exceeded three times in 79 minutes of walking."""


class TargetGuard:
    """Holds the last good targets of robots whose new ones are not finite or jump. The allowed jump grows while targets
    are held, so that no robot is held forever."""

    def __init__(self, robots: int, velocity_limit: Array, period: float) -> None:
        """`velocity_limit` (joints,) [rad/s]; `period`: control period [s]."""
        self._reach = JUMP * velocity_limit * period
        self._last, self._steps = np.zeros((robots, len(velocity_limit))), np.zeros(robots, np.int64)
        self._reasons = ("",) * robots

    def passed(
        self, targets: Array, starts: Mask, position: Array, refusals: Mapping[int, str] = MappingProxyType({})
    ) -> tuple[Array, tuple[str, ...]]:
        """Targets to follow, (n, joints) [rad], and the reason for each robot to hold its last ones, "" if it does not.

        `starts` (n,): robots without last targets; if held, they hold the measured `position` (n, joints) instead.
        `refusals`: reasons of robots that hold theirs in any case.
        """
        last = np.where(starts[:, None], position, self._last)
        finite: Mask = np.asarray(np.isfinite(targets).all(axis=1))
        away = np.abs(np.where(finite[:, None], targets, last) - last) - self._reach * (1 + self._steps)[:, None]
        held: Mask = ~finite | (~starts & np.asarray((away > 0.0).any(axis=1)))
        held[list(refusals)] = True
        reasons = [""] * len(held)
        for robot in np.flatnonzero(held).tolist():
            joint = int(np.argmax(away[robot]))
            jump = f"the target of joint {joint} jumps by {np.abs(targets - last)[robot, joint]:.2f} rad"
            reasons[robot] = refusals.get(robot) or (jump if finite[robot] else "its targets are not finite")
            if not self._reasons[robot]:
                LOG.warning("robot %d: %s: the last good targets are held", robot, reasons[robot])
        self._reasons = tuple(reasons)
        self._steps = np.where(held, np.where(starts, 1, self._steps + 1), 0)
        self._last = np.where(held[:, None], last, targets)
        return self._last.copy(), self._reasons
