"""Left-right mirror maps: reflection across the sagittal plane (y to -y) of joints and vectors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.robot.description import Robot

VECTOR_SIGN = np.array([1.0, -1.0, 1.0])
"""A polar vector (position, velocity, force) in a frame of the sagittal plane."""
AXIAL_SIGN = np.array([-1.0, 1.0, -1.0])
"""An axial vector (angular velocity, torque); also roll, pitch, yaw."""
QUATERNION_SIGN = np.array([1.0, -1.0, 1.0, -1.0])
"""A rotation, wxyz."""


@dataclass(frozen=True)
class MirrorMap:
    """mirrored[..., i] = sign[i] * values[..., permutation[i]]; its own inverse."""

    permutation: Indices
    sign: Array

    def __call__(self, values: Array) -> Array:
        """The mirror image of values, shape (..., size)."""
        return self.sign * values[..., self.permutation]

    def __len__(self) -> int:
        return len(self.permutation)

    def as_float32(self) -> "MirrorMap":
        """The same map for float32 arrays, whose type it keeps."""
        return MirrorMap(self.permutation, self.sign.astype(np.float32))


Kind = Callable[[Robot], MirrorMap]
"""Function that makes an array's mirror map for a robot."""


def in_place(*sign: float) -> Kind:
    """Mirror that keeps the order of the entries and multiplies them by signs."""
    return lambda robot: MirrorMap(np.arange(len(sign)), np.array(sign))


scalar = in_place(1.0)
polar_vector = in_place(*VECTOR_SIGN)
axial_vector = in_place(*AXIAL_SIGN)
turn = in_place(-1.0)
"""An angle about the vertical, or a rate of it."""
rotation = in_place(*QUATERNION_SIGN)
roll_and_pitch = in_place(*AXIAL_SIGN[:2])


def polar_vector_each_side(robot: Robot) -> MirrorMap:
    """Two polar vectors, left and right, which are swapped, (6,)."""
    return MirrorMap(np.array([3, 4, 5, 0, 1, 2]), np.tile(VECTOR_SIGN, 2))


def side_by_side(maps: Sequence[MirrorMap]) -> MirrorMap:
    """Mirror of rows that consist of parts."""
    starts = np.cumsum([0, *map(len, maps)])
    places = [start + one.permutation for start, one in zip(starts, maps, strict=False)]
    return MirrorMap(np.concatenate(places), np.concatenate([one.sign for one in maps]))


def joint_mirror(robot: Robot) -> MirrorMap:
    """Mirror of all joint positions, velocities or torques, in MJCF order, shape (..., joints). A hinge is an axial
    vector: reflection keeps a rotation about y and reverses one about x or z, unless both axes have opposite
    directions."""
    other = {"left": "right", "right": "left"}
    sides = [(other.get(side, side), rest) for side, *rest in (name.split("_") for name in robot.joints)]
    permutation = np.array([robot.joints.index("_".join([side, *rest])) for side, rest in sides])
    leading = [int(np.argmax(np.abs(hinge.axis))) for hinge in robot.tree.hinges()]
    along = np.array([np.sign(hinge.axis[place]) for hinge, place in zip(robot.tree.hinges(), leading, strict=True)])
    return MirrorMap(permutation, AXIAL_SIGN[leading] * along * along[permutation])


def joint_magnitude(robot: Robot) -> MirrorMap:
    """Mirror of joint quantities without a direction, such as torque limits, in MJCF order, shape (..., joints)."""
    places = joint_mirror(robot).permutation
    return MirrorMap(places, np.ones(len(places)))


def support_mirror(robot: Robot) -> MirrorMap:
    """Mirror of the support branch in its own order, shape (..., support joints)."""
    return _restricted(joint_mirror(robot), robot.support)


def interaction_mirror(robot: Robot) -> MirrorMap:
    """Mirror of the interaction branch in its own order, shape (..., arm joints)."""
    return _restricted(joint_mirror(robot), robot.interaction)


def _restricted(whole: MirrorMap, branch: Indices) -> MirrorMap:
    place = {joint: index for index, joint in enumerate(branch.tolist())}
    return MirrorMap(np.array([place[joint] for joint in whole.permutation[branch].tolist()]), whole.sign[branch])
