"""Foot placement by feedback: feet land further ahead when the robot moves faster than commanded, and further behind
when it is slower (Raibert's rule; the capture point of a pendulum).

The speed is that over the standing leg, or the one that has stood longer, from joint velocities and gyroscope. The
offset of a swinging foot moves to that of its landing; on the ground it decays like that of a pendulum. The integral of
the speed error moves both feet further behind while the robot is too slow: the moment of its weight about the feet
pushes a crate.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from iowbc.arrays import Array, Constants, namespace
from iowbc.control.gait import expected_stance, foot_phase, swing_progress
from iowbc.control.odometry import LegOdometry
from iowbc.control.sensors import Measured
from iowbc.recipe.task.joint_references import GaitPrior
from iowbc.robot.description import Robot


@dataclass(frozen=True)
class FootPlacement(Constants):
    """The feedback of a robot. Holds constants only."""

    settings: GaitPrior
    odometry: LegOdometry

    @classmethod
    def of(cls, robot: Robot, settings: GaitPrior) -> Self | None:
        """The feedback of a robot, or none where it is switched off."""
        return None if settings.placement is None else cls(settings, LegOdometry.of(robot))

    def __call__(
        self, foothold: Array, measured: Measured, command: Array, phase: Array, stepping: Array, period: float
    ) -> Array:
        """Forward offset of left foot, right foot and both from their places in the stride a control period [s] later,
        (n, 3) [m].

        `command` C (n, 11); `phase` (n,) of the gait; `stepping` (n,) one while the clock runs, else zero.
        """
        gait, feedback = self.settings, self.settings.placement
        assert feedback is not None
        foot, running = foot_phase(phase), stepping[:, None]
        standing = 1.0 * expected_stance(foot, stepping > 0.5, gait.stance)
        longer = running * (standing * (foot >= gait.stance - 0.5)) + 0.5 * (1.0 - running)
        speed = (longer * self.odometry.speed(measured)).sum(1)
        faster = (speed - command[:, 0])[:, None]
        own, trim = foothold[:, :2], foothold[:, 2:]
        wanted = (feedback.gain * faster).clip(-feedback.longest, feedback.longest)
        left = (1.0 - swing_progress(foot, gait.stance)) * ((1.0 - gait.stance) / gait.frequency)
        landing = own + (wanted - own) * (period / (left + feedback.filter_time))
        back = float(np.exp(-period / feedback.return_time))
        own = (standing * own * back + (1.0 - standing) * landing) * running
        kept = running + (1.0 - running) * back
        trim = trim * kept + feedback.integral * period * faster * running
        return namespace(own).concatenate([own, trim.clip(-feedback.longest_trim, feedback.longest_trim)], -1)
