"""Samples of the dataset, and the support postures that label them."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.robot import rotations


@dataclass(frozen=True)
class Sample:
    """One arm posture and base command."""

    arm: Array
    """Positions of the interaction branch, shape (14,) [rad]."""
    command: Array
    """Height [m] and torso pitch [rad], shape (2,)."""

    @property
    def height(self) -> float:
        """Commanded height [m]."""
        return float(self.command[0])

    def torso_rotation(self) -> Array:
        """Commanded torso orientation relative to the feet: a pitch about the lateral axis, shape (3, 3)."""
        return rotations.matrix(rotations.from_euler(np.zeros(()), self.command[1], np.zeros(())))


@dataclass(frozen=True)
class Posture:
    """A support posture in equilibrium on two soles."""

    configuration: Array
    """Reduced pinocchio configuration: base position, base quaternion xyzw, support joints, shape (22,)."""
    wrench: Array
    """Wrench of the ground on each sole in the sole's frame, force then moment, shape (2, 6) [N, N·m]."""

    @property
    def support(self) -> Array:
        """Support joint positions, shape (15,) [rad]."""
        return self.configuration[7:]
