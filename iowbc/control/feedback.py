"""Leg odometry and its feedback on the references: footholds by speed, legs by height; torso pitch moves the hips."""

from collections.abc import Iterator
from functools import reduce
from operator import add

import numpy as np

from iowbc.arrays import Array, Constants, as_slice, namespace
from iowbc.control.command import HEIGHT, PITCH
from iowbc.control.gait import expected_stance, foot_phase, swing_progress
from iowbc.control.legs import direction, leg_geometry, leg_joints, pitched
from iowbc.control.sensors import Measured
from iowbc.control.stride import ANKLE_PITCH, HIP_PITCH, KNEE
from iowbc.recipe.task.joint_references import GaitPrior, HeightFeedback, Placement, TorsoFeedback
from iowbc.robot.description import Robot


class LegOdometry(Constants):
    """Speed ahead and height of the base, from the legs in the sagittal plane and the inertial unit."""

    def __init__(self, robot: Robot) -> None:
        self._legs = leg_geometry(robot)
        left, right = (robot.support[leg].tolist() for leg in leg_joints(robot))
        self._joints = [[left[joint], right[joint]] for joint in (HIP_PITCH, KNEE, ANKLE_PITCH)]
        """Places of the legs' joints, left and right, among all joints."""

    def speed(self, measured: Measured) -> Array:
        """Forward speed of the base if the respective foot were at rest on the ground, (n, 2) [m/s]."""
        return -reduce(add, (rate * rise for rate, rise in self._segments(measured)))

    def height(self, measured: Measured) -> Array:
        """Height of the base above each sole's centre, (n, 2) [m], for legs in the sagittal plane."""
        return -reduce(add, (rise for _, rise in self._segments(measured)))

    def _segments(self, measured: Measured) -> Iterator[tuple[Array, Array]]:
        """Pitch rate [rad/s] and rise [m] of hip, thigh, shank and sole from the base outward, (n, 2) each."""
        legs, angle = self._legs, measured.pitch[:, None]
        rate = measured.base_angular_velocity[:, 1:2]
        yield rate, pitched(direction(angle), *legs.hip)[1]
        for joint, segment in zip(self._joints, (legs.thigh, legs.shank, legs.sole), strict=True):
            angle = angle + measured.joint_position[:, joint]
            rate = rate + measured.joint_velocity[:, joint]
            yield rate, pitched(direction(angle), *segment)[1]


class FootPlacement(Constants):
    """Foot placement: feet land further ahead when the robot moves faster than commanded, and further behind when it
    is slower (Raibert's rule; the capture point of a pendulum).

    The speed is that over the leg that has stood longer, from joint velocities and gyroscope. The offset of a swinging
    foot moves to that of its landing; on the ground it decays like that of a pendulum. The integral of the speed error
    moves both feet further behind while the robot is too slow: the moment of its weight about them pushes a crate.
    """

    def __init__(self, robot: Robot, gait: GaitPrior, placement: Placement) -> None:
        self.gait, self.placement, self.odometry = gait, placement, LegOdometry(robot)

    def __call__(
        self, foothold: Array, measured: Measured, command: Array, phase: Array, stepping: Array, period: float
    ) -> Array:
        """Forward offset of left foot, right foot and both from their places in the stride a control period [s] later,
        (n, 3) [m]; `command` C (n, 11); `phase` (n,) of the gait; `stepping` (n,) one while its clock runs, else 0."""
        gait, feedback = self.gait, self.placement
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


class LegStretch(Constants):
    """Height feedback: motors yield under load, and the pelvis sags; both legs stretch by the integral of the error."""

    def __init__(self, robot: Robot, settings: HeightFeedback) -> None:
        self.settings, self.odometry = settings, LegOdometry(robot)

    def __call__(self, stretch: Array, measured: Measured, command: Array, period: float) -> Array:
        """Stretch of both legs a control period [s] later, (n, 1) [m]; `command` C (n, 11)."""
        left, right = self.odometry.height(measured).T
        lower = (command[:, HEIGHT] - namespace(left).maximum(left, right))[:, None]
        furthest = self.settings.furthest
        return (stretch + self.settings.integral * period * lower).clip(-furthest, furthest)


class HipFeedback(Constants):
    """Torso feedback: the waist's motors yield under a load, and the torso leans further than commanded. Both hips turn
    the pelvis back by the integral of the error."""

    def __init__(self, robot: Robot, settings: TorsoFeedback) -> None:
        self.settings = settings
        self._waist = as_slice(robot.support[robot.waist_pitch])
        self._hips = np.zeros(len(robot.support))
        self._hips[[leg[HIP_PITCH] for leg in leg_joints(robot)]] = 1.0
        self._lower, self._upper = robot.lower[robot.support], robot.upper[robot.support]

    def __call__(self, turn: Array, measured: Measured, command: Array, period: float) -> Array:
        """Turn of both hips a control period [s] later, (n, 1) [rad]; `command` C (n, 11)."""
        torso = measured.pitch + measured.joint_position[:, self._waist].sum(1)
        further = (torso - command[:, PITCH])[:, None]
        return (turn + self.settings.integral * period * further).clip(-self.settings.least, self.settings.furthest)

    def turned(self, support: Array, turn: Array) -> Array:
        """θ_S_ref with the turn of the hips, (n, support joints) [rad]."""
        return (support + turn * self._hips).clip(self._lower, self._upper)
