"""Observation of the robot at each decision of the skill layer, from its sensors alone."""

from collections.abc import Mapping

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.sensors import Measured
from iowbc.robot import rotations

FORCE = 50.0
"""Unit of observed forces [N], which makes them of the order of one."""
TIME = 10.0
"""The same for remaining times and distances [s, m]."""
SENSED = 44
"""Size of the robot's observation without the estimated forces."""
WAYPOINTS, OBJECT = 9, 10
"""Sizes of the parts of a known path and of the object."""
YAW = 3
"""Place of the yaw in the part of the object."""


def robot_observation(
    command: Array,
    measured: Measured,
    wrist_error: Array,
    thing: Array,
    pushing: Mask,
    known: Mask,
    path: Array,
    felt: Array,
) -> Array:
    """The robot's observation, (n, SENSED + 6 history) float32.

    `command` (n, 11): in force; `wrist_error` (n, 2, 3) [m]; `thing` (n, OBJECT): see `of_object`; `pushing`, `known`
    (n,): whether there is a crate, and whether the path is known; `path` (n, 9): its next waypoints; `felt`
    (n, history, 2, 3): estimated forces on the hands, the newest last [N].
    """
    parts = {
        "command": command,
        "gravity": measured.projected_gravity,
        "rates": measured.base_angular_velocity,
        "wrist_error": 10.0 * wrist_error.reshape(-1, 6),
        "object": thing,
        "pushing": pushing,
        "known": known,
        "waypoints": path * known[:, None],
        "forces": felt.reshape(len(felt), -1) / FORCE,
    }
    return joined(parts)


def joined(parts: Mapping[str, Array]) -> Array:
    """Parts (n, k) or (n,) side by side, (n, sum of k) float32."""
    return np.column_stack([*parts.values()]).astype(np.float32)


def of_object(measured: Measured, sees_object: bool) -> Array:
    """Measured object in the heading frame, (n, OBJECT): its place from the base, yaw, upward axis, velocity and yaw
    rate relative to the base; zero without `sees_object`. Raises ValueError where there is no measurement of it."""
    if not sees_object:
        return np.zeros((len(measured.projected_gravity), OBJECT))
    names = ("object_position", "object_linear_velocity", "object_angular_velocity")
    axes = rotations.rotate(_given(measured, "object_quaternion")[:, None], np.eye(3)[::2])
    vectors = np.concatenate([axes, np.stack([_given(measured, name) for name in names], axis=1)], axis=1)
    forward, up, place, velocity, rates = np.einsum("nij,nkj->kni", leveling(measured.projected_gravity), vectors)
    yaw = np.arctan2(forward[:, 1], forward[:, 0])
    return np.concatenate([place, yaw[:, None], up[:, :2], velocity, rates[:, 2:]], axis=1)


def _given(measured: Measured, name: str) -> Array:
    value: Array | None = getattr(measured, name)
    if value is None:
        raise ValueError(f"{name}: this skill observes the object; measure it")
    return value


def leveling(gravity: Array) -> Array:
    """Rotations (n, 3, 3) from the base frame into the heading frame, of measured directions of gravity (n, 3)."""
    up = -gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    forward = np.array([1.0, 0.0, 0.0]) - up[:, :1] * up
    forward /= np.linalg.norm(forward, axis=1, keepdims=True)
    return np.stack([forward, rotations.cross(up, forward), up], axis=1)
