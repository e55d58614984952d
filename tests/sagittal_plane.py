"""Measurements and soles of a robot that is pitched, for tests of what moves in the sagittal plane."""

from typing import Any

import numpy as np

from iowbc.control.sensors import Measured
from iowbc.robot.description import Robot


def measured(position: Any, velocity: Any, pitch: float, rate: float) -> Measured:
    """One row; `position` and `velocity` (joints,), `pitch` [rad] and its `rate` [rad/s] of the base."""
    return Measured(
        projected_gravity=np.array([[np.sin(pitch), 0.0, -np.cos(pitch)]]),
        base_angular_velocity=np.array([[0.0, rate, 0.0]]),
        heading=np.zeros((1, 1)),
        joint_position=position[None],
        joint_velocity=velocity[None],
    )


def sole(robot: Robot, position: Any, pitch: float, side: int) -> tuple[float, float]:
    """A sole ahead of and above the base, heading frame [m]."""
    place, _ = robot.tree.forward(dict(zip(robot.joints, position, strict=True)), robot.base, robot.soles[side])
    cosine, sine = np.cos(pitch), np.sin(pitch)
    return cosine * place[0] + sine * place[2], cosine * place[2] - sine * place[0]
