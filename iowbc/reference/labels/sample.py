"""A point of the dataset: what is asked of the robot."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.robot import rotations

Array = NDArray[Any]

COMMANDS = ("height", "pitch", "roll", "yaw")
"""Columns of a full base command: height [m], torso pitch, roll and yaw [rad]."""


@dataclass(frozen=True)
class Sample:
    """One arm posture and base command."""

    arm: Array
    """Positions of the interaction branch, shape (14,) [rad]."""
    command: Array
    """Height [m], torso pitch, roll, yaw [rad], shape (4,)."""
    payload: Array
    """Mass held at each wrist, shape (2,) [kg]."""

    @property
    def height(self) -> float:
        """Commanded height [m]."""
        return float(self.command[0])

    def torso_rotation(self) -> Array:
        """Commanded torso orientation against the feet, Rz(yaw) Ry(pitch) Rx(roll), shape (3, 3)."""
        pitch, roll, yaw = self.command[1:]
        return rotations.matrix(rotations.from_euler(roll, pitch, yaw))


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


def mean_stance(width: float) -> Array:
    """Places of the sole centres on the ground, left and right, shape (2, 3) [m]."""
    return np.array([[0.0, 0.5 * width, 0.0], [0.0, -0.5 * width, 0.0]])
