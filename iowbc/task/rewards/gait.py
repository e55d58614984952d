"""r_gait: foot swing and contact timing by the phase."""

import numpy as np

from iowbc.arrays import Array, Mask

LEAST_LOAD = 1.0
"""Force on both feet under which slipping fades out [N]."""


def contact_timing(contact: Mask, expected: Mask) -> Array:
    """Mean over the feet of +1 where contact is as the phase asks and −1 where not, (n,); feet (n, 2)."""
    return (contact == expected).sum(axis=1) * (2.0 / contact.shape[1]) - 1.0


def swing_height(sole_height: Array, profile: Array, swinging: Mask) -> Array:
    """(z − profile)² of swinging feet, infinite for others, (n, 2) [m²]; sole height z and its profile [m]."""
    return np.where(swinging, np.square(sole_height - profile), np.inf)


def foot_slip(foot_velocity: Array, foot_force: Array) -> Array:
    """Horizontal speed of the soles, averaged by the weight that each bears, (n,) [m/s]; velocities and forces
    (n, 2, 3), in m/s and N. Zero in the air."""
    load = np.maximum(foot_force[:, :, 2], 0.0)
    speed = np.sqrt(np.vecdot(foot_velocity[:, :, :2], foot_velocity[:, :, :2]))
    return np.vecdot(speed, load) / np.maximum(load.sum(axis=1), LEAST_LOAD)


def touchdown(sole_height: Array, vertical_velocity: Array, fading: float) -> Array:
    """Σ min(ż, 0)²·exp(−z/fading) over the feet, (n,) [m²/s²]; height z [m] and vertical velocity ż [m/s], (n, 2)."""
    sinking = np.square(np.minimum(vertical_velocity, 0.0))
    return (sinking * np.exp(-np.maximum(sole_height, 0.0) / fading)).sum(axis=1)


def standing(contact: Mask, stepping: Mask) -> Array:
    """Feet off the ground while the clock rests, (n,); feet (n, 2), clock (n,)."""
    return (~contact).sum(axis=1) * ~stepping


def foot_distance(foot_position: Array, smallest: float) -> Array:
    """max(0, d_min − (y_left − y_right))², (n,) [m²]; soles in the heading frame (n, 2, 3) [m]."""
    lack = np.maximum(smallest - (foot_position[:, 0, 1] - foot_position[:, 1, 1]), 0.0)
    return np.square(lack)
