"""r_gait: foot swing and contact timing by the phase."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.task.rewards.kernel import kernel, squared_norm

Array = NDArray[np.floating[Any]]
Mask = NDArray[np.bool_]


def contact_timing(contact: Mask, expected: Mask) -> Array:
    """Mean over the feet of +1 where contact is as the phase asks and −1 where not, (n,); feet (n, 2)."""
    score: Array = (contact == expected).sum(axis=1) * (2.0 / contact.shape[1]) - 1.0
    return score


def swing_height(sole_height: Array, progress: Array, swinging: Mask, clearance: float, width: float) -> Array:
    """Σ over swinging feet of exp(−(z − clearance·sin(π s))²/width²), (n,); sole height z [m], progress s, (n, 2)."""
    profile = clearance * np.sin(np.pi * progress)
    score: Array = (kernel(np.square(sole_height - profile), width) * swinging).sum(axis=1)
    return score


def foot_slip(foot_velocity: Array, contact: Mask) -> Array:
    """Σ |v_horizontal|² of feet in contact, (n,) [m²/s²]; velocities (n, 2, 3)."""
    return squared_norm(foot_velocity[:, :, :2] * contact[:, :, None])


def foot_distance(foot_position: Array, smallest: float) -> Array:
    """max(0, d_min − (y_left − y_right))², (n,) [m²]; soles in the heading frame (n, 2, 3) [m]."""
    lack = np.maximum(smallest - (foot_position[:, 0, 1] - foot_position[:, 1, 1]), 0.0)
    squared: Array = np.square(lack)
    return squared
