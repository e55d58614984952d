"""Formulas of the reward's terms (paper III-D) that are longer than a line of the table, over n environments."""

import numpy as np

from iowbc.arrays import Array, Mask

SLOW = 1e-6
"""Keeps a command to stand from dividing by zero [m/s]."""
LEAST_LIMIT = 1.0
"""Lower bound of a motor's torque limit, which is zero at its no-load speed [N·m]."""
LEAST_LOAD = 1.0
"""Force on both feet under which slipping fades out [N]."""


def squared_norm(values: Array) -> Array:
    """Sum of squares over all axes but the first, (n, ...) to (n,)."""
    flat = values.reshape(len(values), -1)
    return np.vecdot(flat, flat)


def progress(velocity: Array, command: Array) -> Array:
    """v_sys along the commanded velocity, clipped to ± its size, (n,) [m/s]; (n, 2), heading frame. Zero without one.
    Unlike a kernel's, its slope is the same wherever the robot is too slow."""
    speed = np.hypot(command[:, 0], command[:, 1])
    along = np.vecdot(velocity, command) / np.maximum(speed, SLOW)
    return along.clip(-speed, speed)


def turning(rate: Array, command: Array) -> Array:
    """Yaw rate in the commanded direction, clipped to ± the commanded size, (n,) [rad/s]."""
    limit = np.abs(command)
    return (rate * np.sign(command)).clip(-limit, limit)


def tilt(object_quaternion: Array, held: Mask) -> Array:
    """sin² of the angle between the object's vertical axis and gravity, (n,); world orientation (n, 4)."""
    x, y = object_quaternion[:, 1], object_quaternion[:, 2]
    up = 1.0 - 2.0 * (x * x + y * y)
    return (1.0 - np.square(up)) * held


def beside(object_offset: Array, place: Array, most: float, pushed: Mask) -> Array:
    """(y_obj − y_hands)², of no more than `most` [m], (n,) [m²]; from the base, heading frame, (n, 3) [m]."""
    return np.square((object_offset[:, 1] - place[:, 1]).clip(-most, most)) * pushed


def effort(torque: Array, limit: Array, comfortable: float) -> Array:
    """Σ max(|τ|/τ_max − comfortable, 0)², (n,); joints (n, 29) [N·m]."""
    return squared_norm(np.maximum(np.abs(torque) / np.maximum(limit, LEAST_LIMIT) - comfortable, 0.0))


def power(torque: Array, velocity: Array) -> Array:
    """Σ |τ·q̇|, (n,) [W]; joints (n, 29). Braking costs as much as driving: the motors do not recover it."""
    return np.vecdot(np.abs(torque), np.abs(velocity))


def saturation(saturated: Mask) -> Array:
    """Fraction of joints at their torque limit, (n,); joints (n, k)."""
    return saturated.sum(axis=1) / saturated.shape[1]


def contact_timing(contact: Mask, expected: Mask) -> Array:
    """Mean over the feet of +1 where contact agrees with the phase and −1 where not, (n,); feet (n, 2)."""
    return (contact == expected).sum(axis=1) * (2.0 / contact.shape[1]) - 1.0


def swing_height(sole_height: Array, profile: Array, swinging: Mask) -> Array:
    """(z − profile)² of swinging feet, infinite for others, (n, 2) [m²]; sole height z and its profile [m]."""
    return np.where(swinging, np.square(sole_height - profile), np.inf)


def foot_slip(foot_velocity: Array, foot_force: Array) -> Array:
    """Load-weighted mean of the soles' horizontal speeds, (n,) [m/s], zero in the air; (n, 2, 3) in m/s and N."""
    load = np.maximum(foot_force[:, :, 2], 0.0)
    speed = np.sqrt(np.vecdot(foot_velocity[:, :, :2], foot_velocity[:, :, :2]))
    return np.vecdot(speed, load) / np.maximum(load.sum(axis=1), LEAST_LOAD)


def touchdown(sole_height: Array, vertical_velocity: Array, fading: float) -> Array:
    """Σ min(ż, 0)²·exp(−z/fading) over the feet, (n,) [m²/s²]; height z [m] and vertical velocity ż [m/s], (n, 2)."""
    sinking = np.square(np.minimum(vertical_velocity, 0.0))
    return (sinking * np.exp(-np.maximum(sole_height, 0.0) / fading)).sum(axis=1)


def foot_distance(foot_position: Array, smallest: float) -> Array:
    """max(0, d_min − (y_left − y_right))², (n,) [m²]; soles in the heading frame (n, 2, 3) [m]."""
    lack = np.maximum(smallest - (foot_position[:, 0, 1] - foot_position[:, 1, 1]), 0.0)
    return np.square(lack)
