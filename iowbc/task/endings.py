"""When an episode ends early: falls and drops."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.recipe.task.termination import Termination
from iowbc.task.motion import Motion

Array = NDArray[np.floating[Any]]
Mask = NDArray[np.bool_]


def fallen(motion: Motion, pitch_command: Array, termination: Termination) -> Mask:
    """Base or torso beyond the limits, (n,); pitch_command (n,) [rad]."""
    fell: Mask = (
        (motion.pelvis_height < termination.pelvis_height)
        | (motion.pelvis_tilt > termination.pelvis_tilt)
        | (np.abs(motion.torso_roll) > termination.torso_roll)
        | (np.abs(motion.torso_pitch - pitch_command) > termination.torso_pitch_error)
    )
    return fell


def dropped(motion: Motion, place: Array, held: Mask, grasped: Mask, termination: Termination) -> Mask:
    """A held object out of both hands, or too far from its place in the grasp, (n,).

    place: the object's place from the base, heading frame, (n, 3) [m]; grasped: hands that hold, (n, 2).
    """
    distance = np.sqrt(np.square(motion.object_offset - place).sum(axis=1))
    lost: Mask = held & (~grasped.any(axis=1) | (distance > termination.object_distance))
    return lost
