"""The arms' effort that presses both hands against an object between them."""

from typing import Any

import numpy as np

from iowbc.arrays import Array, Indices, as_slice
from iowbc.robot import rotations
from iowbc.robot.description import Robot


class Squeeze:
    """Adds to the joint targets what makes the motors press with a force f: τ = Jᵀ f, target += τ / kp."""

    def __init__(self, robot: Robot, batch: Any, places: str, hands: slice | Indices) -> None:
        """`places`: the field of MuJoCo's data where the points lie with which `hands` press."""
        self._hands, self._arms = hands, as_slice(robot.interaction)
        self._hinges = as_slice(robot.interaction + 1)
        self._anchor, self._axis, self._place = batch.bind("xanchor"), batch.bind("xaxis"), batch.bind(places)
        self._compliance = 1.0 / robot.kp[robot.interaction]

    def add(self, target: Array, force: Array) -> tuple[Array, Array]:
        """Changes the targets (n, joints) of the arms for forces (n,) [N] of each hand; returns the forces towards each
        other, (n, 2, 3) [N], and the points where they press, (n, 2, 3) [m]."""
        points = self._place[:, self._hands]
        inward = points[:, ::-1] - points
        inward *= (force[:, None] / np.sqrt(np.vecdot(inward, inward)))[..., None]
        by_arm = (len(points), 2, -1, 3)
        lever = points[:, :, None] - self._anchor[:, self._hinges].reshape(by_arm)
        torque = self._axis[:, self._hinges].reshape(by_arm) * rotations.cross(lever, inward[:, :, None])
        target[:, self._arms] += torque.sum(axis=3).reshape(len(points), -1) * self._compliance
        return inward, points
