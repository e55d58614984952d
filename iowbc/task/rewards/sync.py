"""r_sync: coupled motion consistency (eq. 8), and the tracking of the rest of the command.

Squared errors; progress, turning and roll count as they are, the others are scored by `kernel`.
"""

import numpy as np

from iowbc.arrays import Array
from iowbc.task.rewards.kernel import squared_norm

SLOW = 1e-6
"""Keeps a command to stand from dividing by zero [m/s]."""


def support_reference(support_position: Array, support_reference: Array) -> Array:
    """‖θ_S − θ_S_ref‖², (n,) [rad²]; joints (n, 15). The paper's first term of eq. 8."""
    return squared_norm(support_position - support_reference)


def system_velocity(velocity: Array, command: Array) -> Array:
    """‖v_sys − v_coll‖² in the plane, (n,) [m²/s²]; (n, 2), heading frame. The paper's second term of eq. 8."""
    return squared_norm(velocity - command)


def yaw_rate(rate: Array, command: Array) -> Array:
    """(ω − ω_yaw)², (n,) [rad²/s²]; filtered rate (n,)."""
    return np.square(rate - command)


def progress(velocity: Array, command: Array) -> Array:
    """v_sys along the commanded velocity, no more than commanded, (n,) [m/s]; (n, 2), heading frame. Zero without one.

    Its slope is the same wherever the robot is too slow, unlike that of a kernel, which is flat far from the command.
    """
    speed = np.hypot(command[:, 0], command[:, 1])
    along = np.vecdot(velocity, command) / np.maximum(speed, SLOW)
    return along.clip(-speed, speed)


def turning(rate: Array, command: Array) -> Array:
    """Yaw rate towards the commanded one, no more than commanded, (n,) [rad/s]."""
    limit = np.abs(command)
    return (rate * np.sign(command)).clip(-limit, limit)


def heading(error: Array) -> Array:
    """(ψ − ψ_ref)², (n,) [rad²]; the reference integrates the commanded yaw rate."""
    return np.square(error)


def height(pelvis_height: Array, command: Array) -> Array:
    """(h − H)², (n,) [m²]."""
    return np.square(pelvis_height - command)


def torso_pitch(pitch: Array, command: Array) -> Array:
    """(α − α_pitch)², (n,) [rad²]."""
    return np.square(pitch - command)


def torso_roll(roll: Array) -> Array:
    """roll², (n,) [rad²]. The command asks for none."""
    return np.square(roll)
