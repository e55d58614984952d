"""Foot placement by feedback: feet land further ahead, or behind, as the robot is felt to move faster, or slower, than
commanded (Raibert's rule; the capture point of a pendulum).

The speed is that of the standing leg, or of the one that has stood longer, by joint velocities and gyroscope. While a
foot swings, its place goes to where it should land; on the ground it comes back under the pelvis as a pendulum's would.
Both feet trail further behind for as long as the robot stays behind its command, by the integral of the difference: the
moment of its weight about them is what pushes a crate.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from iowbc.arrays import Array, Constants, namespace
from iowbc.control.gait import expected_stance, foot_phase, swing_progress
from iowbc.control.legs import Legs, direction, leg_geometry, leg_joints, pitched
from iowbc.control.sensors import Measured
from iowbc.recipe.task.joint_references import GaitPrior
from iowbc.robot.description import Robot

SAGITTAL = (0, 3, 4)
"""Hip pitch, knee and ankle pitch among the joints of a leg."""


@dataclass(frozen=True)
class FootPlacement(Constants):
    """The feedback of a robot. Holds constants only."""

    settings: GaitPrior
    legs: Legs
    joints: tuple[tuple[int, ...], ...]
    """Places of hip pitch, knee and ankle pitch, left and right, among all joints."""

    @classmethod
    def of(cls, robot: Robot, settings: GaitPrior) -> Self | None:
        """The feedback of a robot, or none where it is switched off."""
        if settings.placement is None:
            return None
        left, right = leg_joints(robot)
        places = tuple((int(robot.support[left[j]]), int(robot.support[right[j]])) for j in SAGITTAL)
        return cls(settings, leg_geometry(robot), places)

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
        speed = (longer * self.speed(measured)).sum(1)
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

    def speed(self, measured: Measured) -> Array:
        """Speed ahead of the base over each foot, were it at rest on the ground, (n, 2) [m/s]."""
        legs, angle = self.legs, measured.pitch[:, None]
        rate = measured.base_angular_velocity[:, 1:2]
        speed = -rate * pitched(direction(angle), *legs.hip)[1]
        for joint, segment in zip(self.joints, (legs.thigh, legs.shank, legs.sole), strict=True):
            angle = angle + measured.joint_position[:, list(joint)]
            rate = rate + measured.joint_velocity[:, list(joint)]
            speed = speed - rate * pitched(direction(angle), *segment)[1]
        return speed
