"""What is passed on to the motors: targets that are numbers, and that a joint could have followed."""

import logging

import numpy as np

from iowbc.arrays import Array, Mask

LOG = logging.getLogger(__name__)


class TargetGuard:
    """Holds the last good targets of robots whose new ones are not finite or jump further than the joints move.

    While targets are held, the way that counts as a jump grows with the time, so that a robot is never held for good.
    """

    def __init__(self, robots: int, velocity_limit: Array, period: float) -> None:
        """`velocity_limit` (joints,) [rad/s]; `period` of the control loop [s]."""
        self._reach = velocity_limit * period
        self._last, self._steps = np.zeros((robots, len(velocity_limit))), np.zeros(robots, np.int64)

    def passed(self, targets: Array, starts: Mask, position: Array) -> tuple[Array, Mask]:
        """Targets to follow, (n, joints) [rad], and the robots that hold their last ones, (n,).

        `starts` (n,): robots that have no last ones yet; they hold the measured `position` (n, joints) instead, if they
        must.
        """
        first = starts[:, None]
        last = np.where(first, position, self._last)
        finite: Mask = np.asarray(np.isfinite(targets).all(axis=1))
        away = np.abs(np.where(finite[:, None], targets, last) - last) - self._reach * (1 + self._steps)[:, None]
        held: Mask = ~finite | (~starts & np.asarray((away > 0.0).any(axis=1)))
        if held.any():
            self._tell(held & (starts | (self._steps == 0)), finite, away)
        self._steps = np.where(held, np.where(starts, 1, self._steps + 1), 0)
        self._last = np.where(held[:, None], last, targets)
        return self._last.copy(), held

    def _tell(self, which: Mask, finite: Mask, away: Array) -> None:
        """Log why robots hold their targets from now on."""
        for robot in np.flatnonzero(which):
            joint = int(np.argmax(away[robot]))
            jump = f"the target of joint {joint} jumps by {away[robot, joint] + self._reach[joint]:.2f} rad"
            LOG.warning(
                "robot %d: %s: the last good targets are held",
                robot,
                jump if finite[robot] else "its targets are not finite",
            )
