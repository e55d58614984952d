"""r_sync: coupled motion consistency (eq. 7), and the tracking of the rest of the command.

Squared errors; all but the roll are scored by `kernel`.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.task.rewards.kernel import squared_norm

Array = NDArray[np.floating[Any]]


def support_reference(support_position: Array, support_reference: Array) -> Array:
    """‖θ_S − θ_S_ref‖², (n,) [rad²]; joints (n, 15). The paper's first term of eq. 7."""
    return squared_norm(support_position - support_reference)


def system_velocity(velocity: Array, command: Array) -> Array:
    """‖v_sys − v_coll‖² in the plane, (n,) [m²/s²]; (n, 2), heading frame. The paper's second term of eq. 7."""
    return squared_norm(velocity - command)


def yaw_rate(rate: Array, command: Array) -> Array:
    """(ω − ω_yaw)², (n,) [rad²/s²]; filtered rate (n,)."""
    return np.square(rate - command)


def height(pelvis_height: Array, command: Array) -> Array:
    """(h − H)², (n,) [m²]."""
    return np.square(pelvis_height - command)


def torso_pitch(pitch: Array, command: Array) -> Array:
    """(α − α_pitch)², (n,) [rad²]."""
    return np.square(pitch - command)


def torso_roll(roll: Array) -> Array:
    """roll², (n,) [rad²]. The command asks for none."""
    return np.square(roll)
