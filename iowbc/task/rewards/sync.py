"""r_sync: coupled motion consistency (eq. 7), and the tracking of the rest of the command."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.task.rewards.kernel import kernel, squared_norm

Array = NDArray[np.floating[Any]]


def support_reference(support_position: Array, support_reference: Array, width: float) -> Array:
    """exp(−‖θ_S − θ_S_ref‖²/width²); joints (n, 15) [rad]. The paper's first term of eq. 7."""
    return kernel(squared_norm(support_position - support_reference), width)


def system_velocity(velocity: Array, command: Array, width: float) -> Array:
    """exp(−‖v_sys − v_coll‖²/width²) in the plane; (n, 2) [m/s], heading frame. The paper's second term of eq. 7."""
    return kernel(squared_norm(velocity - command), width)


def yaw_rate(rate: Array, command: Array, width: float) -> Array:
    """exp(−(ω − ω_yaw)²/width²); filtered rate (n,) [rad/s]."""
    return kernel(np.square(rate - command), width)


def height(pelvis_height: Array, command: Array, width: float) -> Array:
    """exp(−(h − H)²/width²); (n,) [m]."""
    return kernel(np.square(pelvis_height - command), width)


def torso_pitch(pitch: Array, command: Array, width: float) -> Array:
    """exp(−(α − α_pitch)²/width²); (n,) [rad]."""
    return kernel(np.square(pitch - command), width)


def torso_roll(roll: Array) -> Array:
    """roll²; (n,) [rad²]. The command asks for none."""
    return np.square(roll)
