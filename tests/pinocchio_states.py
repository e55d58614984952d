"""States of a robot as pinocchio writes them."""

import numpy as np

from iowbc.arrays import Array


def configuration(position: Array, quaternion: Array, joints: Array) -> Array:
    """pinocchio's q (7 + joints,) from base position (3,), quaternion wxyz (4,) and joints; pinocchio writes xyzw."""
    return np.concatenate([position, np.roll(quaternion, -1), joints])
