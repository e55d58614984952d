"""Leg odometry: speed and height of the base above a foot that stands."""

from collections.abc import Iterator
from functools import reduce
from operator import add

from iowbc.arrays import Array, Constants
from iowbc.control.legs import direction, leg_geometry, leg_joints, pitched
from iowbc.control.sensors import Measured
from iowbc.control.stride import ANKLE_PITCH, HIP_PITCH, KNEE
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
