"""The arms' effort that presses both palms against an object between them."""

from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.sim.model_index import Layout


class Squeeze:
    """Adds to the joint targets what makes the motors press with a force f: τ = Jᵀ f, target += τ / kp."""

    def __init__(self, robot: Robot, batch: Any, layout: Layout, force: float) -> None:
        if layout.palms is None:
            raise ValueError("palms are needed to squeeze an object")
        self._palms, self._arms, self._force = layout.palms, robot.interaction, force
        self._anchor, self._axis, self._place = batch.bind("xanchor"), batch.bind("xaxis"), batch.bind("geom_xpos")
        self._compliance = 1.0 / robot.kp[robot.interaction]

    def add(self, target: Array) -> None:
        """Changes the targets (n, joints) of the arms."""
        palms = self._place[:, self._palms]
        inward = palms[:, ::-1] - palms
        inward *= self._force / np.linalg.norm(inward, axis=2, keepdims=True)
        hinges = self._arms + 1
        half = len(hinges) // 2
        lever = np.repeat(palms, half, axis=1) - self._anchor[:, hinges]
        torque = self._axis[:, hinges] * rotations.cross(lever, np.repeat(inward, half, axis=1))
        target[:, self._arms] += torque.sum(axis=2) * self._compliance
