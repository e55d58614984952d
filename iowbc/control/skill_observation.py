"""What a robot observes at each decision of the skill layer, from its sensors alone."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.robot import rotations

FORCE = 50.0
"""Forces are observed in this unit [N], so that parts are of the size of one."""
TIME = 10.0
"""The same for times and ways left [s, m]."""
SENSED = 44
"""Size of what the robot observes beside the estimated forces."""


class Sensed(Protocol):
    """Measurements of n robots, as `iowbc.control.sensors.Measured` has them with an object."""

    projected_gravity: Array
    base_angular_velocity: Array
    object_position: Array
    object_quaternion: Array
    object_linear_velocity: Array
    object_angular_velocity: Array


def robot_observation(
    command: Array,
    measured: Sensed,
    wrist_error: Array,
    sees_object: bool,
    pushing: Mask,
    known: Mask,
    path: Array,
    felt: Array,
) -> Array:
    """The robot's observation, (n, SENSED + 6 history) float32.

    `command` (n, 11): in force; `wrist_error` (n, 2, 3) [m]; `pushing`, `known` (n,): whether there is a crate, and
    whether the path is known; `path` (n, 9): its next waypoints; `felt` (n, history, 2, 3): estimated forces on the
    hands, the newest last [N].
    """
    parts = sensed(command, measured, wrist_error, sees_object)
    parts |= {"pushing": pushing, "known": known, "waypoints": path * known[:, None]}
    return joined(parts | {"forces": felt.reshape(len(felt), -1) / FORCE})


def joined(parts: Mapping[str, Array]) -> Array:
    """Parts (n, k) or (n,) side by side, (n, sum of k) float32."""
    columns = [values if values.ndim == 2 else values[:, None] for values in parts.values()]
    return np.concatenate(columns, axis=1).astype(np.float32)


def sensed(command: Array, measured: Sensed, wrist_error: Array, sees_object: bool) -> dict[str, Array]:
    """What a robot senses, heading frame: `command` (n, 11), `wrist_error` (n, 2, 3) [m]; without `sees_object` the
    object's part is zero."""
    parts = {
        "command": command,
        "gravity": measured.projected_gravity,
        "rates": measured.base_angular_velocity,
        "wrist_error": 10.0 * wrist_error.reshape(-1, 6),
    }
    level = leveling(measured.projected_gravity)
    forward, up = _axes(measured)
    vectors = [measured.object_position, forward, up, measured.object_linear_velocity, measured.object_angular_velocity]
    place, forward, up, velocity, rates = (_turned(level, vector) for vector in vectors)
    of_object = [place, _yaw(forward)[:, None], up[:, :2], velocity, rates[:, 2:]]
    return parts | {"object": np.concatenate(of_object, axis=1) * sees_object}


def object_yaw(measured: Sensed) -> Array:
    """Measured yaw of the object in the heading frame, (n,) [rad]."""
    return _yaw(_turned(leveling(measured.projected_gravity), _axes(measured)[0]))


def _axes(measured: Sensed) -> list[Array]:
    """The object's forward and upward axes in the base frame, (n, 3) each."""
    quaternion = measured.object_quaternion
    return [rotations.rotate(quaternion, np.tile(axis, (len(quaternion), 1))) for axis in np.eye(3)[::2]]


def _turned(rotation: Array, vectors: Array) -> Array:
    turned: Array = np.einsum("nij,nj->ni", rotation, vectors)
    return turned


def _yaw(forward: Array) -> Array:
    yaw: Array = np.arctan2(forward[:, 1], forward[:, 0])
    return yaw


def leveling(gravity: Array) -> Array:
    """Rotations (n, 3, 3) from the base frame into the heading frame, of measured directions of gravity (n, 3)."""
    up = -gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    forward = np.array([1.0, 0.0, 0.0]) - up[:, :1] * up
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    return np.stack([forward, rotations.cross(up, forward), up], axis=1)
