"""r_obj: equilibrium of the object; terms are zero where nothing is held, or nothing pushed."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.task.rewards.kernel import squared_norm


def position(object_offset: Array, place: Array, held: Mask) -> Array:
    """‖x_obj − x_grasp‖², (n,) [m²]; object and its place in the grasp from the base, heading frame, (n, 3) [m]."""
    return squared_norm(object_offset - place) * held


def orientation(object_quaternion: Array, held: Mask) -> Array:
    """sin² of the angle between the object's vertical axis and gravity, (n,); world orientation (n, 4)."""
    x, y = object_quaternion[:, 1], object_quaternion[:, 2]
    up = 1.0 - 2.0 * (x * x + y * y)
    return (1.0 - np.square(up)) * held


def link_contact(force: Array, most: float) -> Array:
    """Force of links other than the hands on the object, no more than `most`, (n,) [N]."""
    return np.minimum(force, most)


def beside(object_offset: Array, place: Array, most: float, pushed: Mask) -> Array:
    """(y_obj − y_hands)², of no more than `most` [m], (n,) [m²]; from the base, heading frame, (n, 3) [m]."""
    return np.square((object_offset[:, 1] - place[:, 1]).clip(-most, most)) * pushed


def vertical_velocity(object_velocity: Array, commanded: Array, held: Mask) -> Array:
    """(ż_obj − ż_command)², (n,) [m²/s²]; world velocity (n, 3), rate of the commanded height (n,) [m/s]."""
    return np.square(object_velocity[:, 2] - commanded) * held
