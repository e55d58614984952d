"""Estimates of the forces on the hands without force sensors, from the torques of the arms."""

import numpy as np

from iowbc.arrays import Array
from iowbc.control.references import ReferenceLayer
from iowbc.robot.description import Robot

DAMPING = 0.002
"""Added to the squares of the Jacobian's singular values [m²]. With 0.02 the forward force is underestimated by half
(slope 0.4 against the true one), with 0.001 its error grows by a half."""


class HandForces:
    """Estimates forces of the object on the hands, of n robots, from means over a decision."""

    def __init__(self, robot: Robot, references: ReferenceLayer, n: int, history: int) -> None:
        self.felt = np.zeros((n, history, 2, 3))
        """Forces on left and right hand in the last decisions, the newest last, heading frame [N]."""
        self._robot, self._arms = robot, references.arms
        self._sum = np.zeros((3, n, len(robot.joints)))
        self._count = 0

    def restart(self) -> None:
        """Drops the control steps of a decision that was broken off."""
        self._sum[:], self._count = 0.0, 0

    def add(self, target: Array, position: Array, velocity: Array) -> None:
        """Adds a control step: joint targets and measurements, (n, joints) [rad, rad/s]."""
        self._sum += np.stack([target, position, velocity])
        self._count += 1

    def read(self, gravity: Array) -> Array:
        """Adds the forces of a decision to `felt` and restarts the means; wrist positions (n, 2, 3) [m] in the torso
        frame. `gravity` (n, 3): measured direction in the base frame.

        Without acceleration τ = g(q) - Jᵀ F, hence F = (J Jᵀ + λ)⁻¹ J (g - τ) with τ = kp (target - q) - kd q̇.
        """
        target, position, velocity = self._sum / self._count
        self.restart()
        own, waist = self._robot.interaction, position[:, self._robot.waist]
        torque = self._robot.kp[own] * (target - position)[:, own] - self._robot.kd[own] * velocity[:, own]
        frames = self._arms.frames(position[:, own])
        borne = self._arms.torque(position[:, own], waist, gravity, frames=frames)
        missing = (borne - torque).reshape(len(position), 2, -1)
        wrists, jacobian = self._arms.forward(position[:, own], frames)
        square = jacobian @ jacobian.swapaxes(2, 3) + DAMPING * np.eye(3)
        force = np.linalg.solve(square, jacobian @ missing[..., None])[..., 0]
        pitch = np.arcsin(gravity[:, 0].clip(-1.0, 1.0))
        roll = np.arctan2(-gravity[:, 1], -gravity[:, 2])
        torso, _ = self._arms.torso_in_heading(waist, pitch, roll)
        self.felt = np.concatenate([self.felt[:, 1:], (force @ torso.swapaxes(1, 2))[:, None]], axis=1)
        return wrists
