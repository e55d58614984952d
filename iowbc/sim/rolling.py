"""Dry friction of a crate's wheels: isotropic, and coupled with its yaw.

Three tendons without elasticity lie along orthonormal directions of the space of (x, y, arm · yaw); they are
re-oriented in each control period. With w the crate's velocity there, friction is -R w / |w| (an ellipsoidal limit
surface, Goyal et al. 1991), whose exact linearisation is dry friction R along w and damping R / |w| across it. A crate
at rest sticks along the force on it up to R.
"""

from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.simulation.scene import Scene
from iowbc.robot import rotations
from iowbc.robot.rotations import TINY
from iowbc.sim.model import ModelIndex
from iowbc.sim.model_fields import ModelFields

TORQUE_FIRST = [3, 4, 5, 0, 1, 2]
"""Order of MuJoCo's spatial forces."""


class Rolling:
    """Wheels of n crates."""

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
