"""Forces of the hands on a held object besides their connection: torsion of the palms, pressure of the arms."""

from typing import Any

import numpy as np

from iowbc.arrays import Array, Indices, as_slice
from iowbc.recipe.simulation.scene import Grasp, Object
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.robot.rotations import TINY
from iowbc.sim.model import ModelIndex
from iowbc.sim.shapes import measured


class Grip:
    """Elastic, damped and slipping torsion between hands and object in n simulations, held over a control period. Its
    angle is the integral of the rate at which the object turns against the hands, cut where the palms slip."""

    def __init__(self, batch: Any, layout: ModelIndex, thing: Object, grasp: Grasp, period: float) -> None:
        self._layout, self._grasp, self._period = layout, grasp, period
        self._sites, self._spatial = batch.bind("site_xpos"), batch.bind("cvel")
        self._about = measured(thing).about_axes[1] + grasp.height**2
        count = len(self._sites)
        self.angle, self.rate = np.zeros(count), np.zeros(count)

    def twist(self, mass: Array, slip_force: Array, connected: Array) -> Array:
        """Torque of the hands on the object over the next period, (n, 3) [N·m]. `mass` (n,): inertial [kg];
        `slip_force` (n,): of each hand [N]; `connected` (n, 2): 1 for hands that hold."""
        hands = self._sites[:, self._layout.grips]
        axis = hands[:, 0] - hands[:, 1]
        axis /= (np.sqrt(np.vecdot(axis, axis)) + TINY)[:, None]
        turning = self._spatial[:, self._layout.hands, :3]
        relative = self._spatial[:, self._layout.object, :3] - 0.5 * (turning[:, 0] + turning[:, 1])
        rate = np.vecdot(relative, axis)
        self.angle += 0.5 * self._period * (rate + self.rate)
        self.rate[:] = rate
        inertia = self._about * mass
        stable = self._grasp.stability * inertia / self._period
        stiffness = np.minimum(self._grasp.stiffness, stable / self._period)
        holding = 0.5 * (connected[:, 0] + connected[:, 1])
        most = 2.0 * self._grasp.torsion * slip_force * holding
        reach = most / np.maximum(stiffness, TINY)
        self.angle.clip(-reach, reach, out=self.angle)
        lag = 0.5 * self._period * stiffness  # a held torque lags half a period, which would excite the swing
        damping = np.minimum(self._grasp.swing_damping * inertia + lag, stable)
        size = (stiffness * self.angle + damping * rate).clip(-most, most)
        return axis * -size[:, None]


class Squeeze:
    """Adds offsets to the joint targets so that the motors press with a force f: τ = Jᵀ f, target += τ / kp."""

    def __init__(self, robot: Robot, batch: Any, places: str, hands: slice | Indices) -> None:
        """`places`: field of MuJoCo's data that holds the points with which `hands` press."""
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
