"""Left-right mirror maps of observation, privileged observation and action: the same world seen in a mirror."""

import numpy as np

from iowbc.control.observation import FullLayout, ObservationLayout
from iowbc.robot.description import Robot
from iowbc.robot.mirror import AXIAL_SIGN, VECTOR_SIGN, MirrorMap, joint_mirror, support_mirror

VECTORS = (
    "projected_gravity",
    "object_position",
    "object_linear_velocity",
    "object_com_offset",
    "base_linear_velocity",
    "system_velocity",
    "external_force",
)
"""Parts that turn over like a polar vector."""
AXIAL_VECTORS = ("base_angular_velocity", "object_orientation", "object_angular_velocity", "external_torque")
"""Parts that turn over like an axial vector."""
PHASE_SIGN = -np.ones(2)
"""Half a stride later: (sin, cos) of the phase change sign, and the zero of standing stays."""


def command_mirror() -> MirrorMap:
    """Mirror of the 11-D command: v_y, yaw rate and the y offsets change sign, the wrists change sides."""
    permutation = np.array([0, 1, 2, 3, 4, 8, 9, 10, 5, 6, 7])
    return MirrorMap(permutation, np.array([1.0, -1.0, -1.0, 1.0, 1.0, *VECTOR_SIGN, *VECTOR_SIGN]))


def action_mirror(robot: Robot) -> MirrorMap:
    """Mirror of the residual action, (15,)."""
    return _as_float32(support_mirror(robot))


def observation_mirror(robot: Robot, layout: ObservationLayout | FullLayout) -> MirrorMap:
    """Mirror of a row of s_t, of s_priv, or of both, (layout.size,)."""
    permutation, sign = np.arange(layout.size), np.ones(layout.size)
    for name, place in layout.slices.items():
        part = _part_mirror(robot, name.removeprefix("privileged/"), place.stop - place.start)
        permutation[place] = place.start + part.permutation
        sign[place] = part.sign
    return _as_float32(MirrorMap(permutation, sign))


def _part_mirror(robot: Robot, name: str, size: int) -> MirrorMap:
    itself = np.arange(size)
    if name == "command":
        return command_mirror()
    if name in ("joint_position", "joint_velocity"):
        return joint_mirror(robot)
    if name in ("last_action", "support_reference"):
        return support_mirror(robot)
    if name == "phase":
        return MirrorMap(itself, PHASE_SIGN)
    if name == "foot_force":
        return MirrorMap(np.array([3, 4, 5, 0, 1, 2]), np.array([*VECTOR_SIGN, *VECTOR_SIGN]))
    if name in VECTORS:
        return MirrorMap(itself, VECTOR_SIGN)
    if name in AXIAL_VECTORS:
        return MirrorMap(itself, AXIAL_SIGN)
    if size == 1:
        return MirrorMap(itself, np.ones(1))
    raise ValueError(f"no mirror is known for the observation's part {name!r} of size {size}")


def _as_float32(mirror: MirrorMap) -> MirrorMap:
    return MirrorMap(mirror.permutation, mirror.sign.astype(np.float32))
