"""Forces on an object besides its contacts and connections: torsion of the palms, pressure of the arms, friction of a
crate's wheels."""

from typing import Any

import numpy as np

from iowbc.arrays import Array, Indices, as_slice
from iowbc.recipe.simulation.scene import Grasp, Object, Scene
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.robot.rotations import TINY
from iowbc.sim.model import ModelIndex
from iowbc.sim.model_fields import ModelFields
from iowbc.sim.objects import measured

TORQUE_FIRST = [3, 4, 5, 0, 1, 2]
"""Order of MuJoCo's spatial forces."""


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


class Rolling:
    """Dry friction of the wheels of n crates: isotropic, and coupled with yaw.

    Three tendons without elasticity lie along orthonormal directions of the space of (x, y, arm · yaw); they are
    re-oriented in each control period. With w the crate's velocity there, friction is -R w / |w| (an ellipsoidal
    limit surface, Goyal et al. 1991), whose exact linearisation is dry friction R along w and damping R / |w|
    across it. A crate at rest sticks along the force on it up to R.
    """

    def __init__(self, batch: Any, layout: ModelIndex, fields: ModelFields, scene: Scene) -> None:
        self._thing, self._rolling = layout.object, fields.rolling
        self._speeds = slice(layout.joint_speeds.stop, None)
        self._arm, self._slow = scene.yaw_arm, scene.creep
        self._velocity, self._external = batch.bind("qvel"), batch.bind("cfrc_ext")
        self._place, self._centre = batch.bind("xpos"), batch.bind("xipos")
        self._scale = np.array([1.0, 1.0, self._arm])
        self.touch = np.zeros((len(self._velocity), 6))
        """Contact wrench on the crates: torque about the centre of mass, and force, (n, 6)."""

    def turn(self, resistance: Array, wrench: Array) -> None:
        """Directs friction over the next period: `resistance` (n,) [N]; `wrench` (n, 6): applied to the crate in
        addition to contacts, about its centre of mass [N, N·m]."""
        moving = self._velocity[:, self._speeds] * self._scale
        speed = np.sqrt(np.vecdot(moving, moving))
        slides = speed > self._slow
        ahead = np.where(slides[:, None], moving, self._push(wrench))
        length = np.sqrt(np.vecdot(ahead, ahead))
        ahead /= np.maximum(length, TINY)[:, None]
        ahead[length < TINY] = (1.0, 0.0, 0.0)
        self._direct(ahead)
        dry, damping, _ = self._rolling
        dry[:, 0] = resistance
        dry[:, 1:] = np.where(slides, 0.0, resistance)[:, None]
        damping[:, 1:] = np.where(slides, resistance / np.maximum(speed, self._slow), 0.0)[:, None]

    def observe(self, wrench: Array) -> None:
        """Stores the contact wrench at the end of a period in which `wrench` (n, 6) was applied."""
        np.subtract(self._external[:, self._thing], wrench[:, TORQUE_FIRST], out=self.touch)

    def _push(self, wrench: Array) -> Array:
        """Force on the crates without that of their wheels, and its vertical torque over the arm, (n, 3) [N]."""
        force = self.touch + wrench[:, TORQUE_FIRST]
        lever = self._centre[:, self._thing] - self._place[:, self._thing]
        pushed: Array = force[:, 3:].copy()
        turning = force[:, 2] + lever[:, 0] * force[:, 4] - lever[:, 1] * force[:, 3]
        pushed[:, 2] = turning / self._arm
        return pushed

    def _direct(self, ahead: Array) -> None:
        """Writes the tendons' coefficients for their first direction, unit vectors (n, 3)."""
        steep = np.abs(ahead[:, 2]) > 0.9
        other = np.zeros_like(ahead)
        other[:, 2], other[:, 0] = ~steep, steep
        across = rotations.cross(other, ahead)
        across /= np.sqrt(np.vecdot(across, across))[:, None]
        frame = np.stack([ahead, across, rotations.cross(ahead, across)], axis=1)
        self._rolling[2][:] = (frame * self._scale).reshape(len(ahead), -1)
