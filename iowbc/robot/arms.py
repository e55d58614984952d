"""Kinematics of both arms, many rows at once in NumPy: forward, Jacobian, damped differential IK (paper eq. 2, 3)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.robot.mjcf import Body

Array = NDArray[Any]

DAMPING = 0.05
"""Damping of the pseudo-inverse [m]: joint motion is bounded by |Δx| / (2·DAMPING) next to a singular posture."""
POSTURE_GAIN = 1.0
"""Rate at which the redundant joints return to the rest posture [1/s]."""


class ArmKinematics:
    """Both arms from the torso frame to the wrist sites; joints as in the interaction branch, left 7, right 7."""

    def __init__(
        self,
        robot: Robot,
        *,
        joint_speed: float | None = None,
        damping: float = DAMPING,
        posture_gain: float = POSTURE_GAIN,
    ) -> None:
        """`joint_speed`: bound on the references' speed [rad/s]; without it each joint's own limit."""
        names = [robot.joints[index] for index in robot.interaction]
        chains = [robot.tree.chain(body, robot.torso) for body in robot.wrist_bodies]
        order = [names.index(body.hinge.name) for chain in chains for body in chain if body.hinge is not None]
        if order != list(range(len(names))):
            raise ValueError(f"{robot.folder}: the arm joints must be the left chain followed by the right one")
        self.rest = robot.default_position[robot.interaction]
        self.lower, self.upper = robot.lower[robot.interaction], robot.upper[robot.interaction]
        own = robot.velocity_limit[robot.interaction]
        self.speed = own if joint_speed is None else np.minimum(own, joint_speed)
        self.damping, self.posture_gain = damping, posture_gain
        self._offset = np.stack([np.stack([body.position for body in chain]) for chain in chains], axis=1)
        self._rotation = np.stack([rotations.matrix(np.stack([body.quaternion for body in c])) for c in chains], axis=1)
        self._skew, self._square = _rodrigues([[_axis(body) for body in chain] for chain in chains])
        self._axis = np.stack([np.stack([_axis(body) for body in chain]) for chain in chains], axis=1)
        self._grip = robot.grip_offset
        waist = robot.tree.chain(robot.torso, robot.base)
        self._waist = [(body.position, rotations.matrix(body.quaternion), _axis(body)) for body in waist]

    def forward(self, arm_position: Array) -> tuple[Array, Array]:
        """Wrist positions (n, 2, 3) [m] in the torso frame and their Jacobian (n, 2, 3, 7), of arms (n, 14) [rad]."""
        count, joints = len(arm_position), self._offset.shape[0]
        angle = arm_position.reshape(count, 2, joints)
        sine, versine = np.sin(angle), 1.0 - np.cos(angle)
        origins, axes = np.empty((count, 2, joints, 3)), np.empty((count, 2, joints, 3))
        position = np.zeros((count, 2, 3))
        rotation = np.broadcast_to(np.eye(3), (count, 2, 3, 3))
        for j in range(joints):
            position = position + np.einsum("nsij,sj->nsi", rotation, self._offset[j])
            rotation = rotation @ self._rotation[j]
            origins[:, :, j] = position
            axes[:, :, j] = np.einsum("nsij,sj->nsi", rotation, self._axis[j])
            turn = sine[:, :, j, None, None] * self._skew[j] + versine[:, :, j, None, None] * self._square[j]
            rotation = rotation + rotation @ turn
        wrist = position + np.einsum("nsij,sj->nsi", rotation, self._grip)
        jacobian = rotations.cross(axes, wrist[:, :, None] - origins)
        return wrist, np.swapaxes(jacobian, -1, -2)

    def solve_step(self, arm_position: Array, target: Array, dt: float) -> Array:
        """One step of differential IK (paper eq. 3), damped, with the redundancy drawn to the rest posture.

        `arm_position` (n, 14) [rad]; `target` wrist positions (n, 2, 3) [m] in the torso frame; `dt` [s].
        next = q + J⁺(x - FK(q)) + (1 - J⁺J) k (rest - q) dt with J⁺ = Jᵀ(JJᵀ + λ²)⁻¹,
        kept to the joint ranges and the joint speed.
        """
        count = len(arm_position)
        wrist, jacobian = self.forward(arm_position)
        transposed = np.swapaxes(jacobian, -1, -2)
        gram = jacobian @ transposed + self.damping**2 * np.eye(3)
        posture = (self.posture_gain * dt * (self.rest - arm_position)).reshape(count, 2, -1)
        wanted = target - wrist - np.einsum("nsij,nsj->nsi", jacobian, posture)
        step = posture + np.einsum("nsji,nsj->nsi", jacobian, np.linalg.solve(gram, wanted[..., None])[..., 0])
        bound = self.speed * dt
        moved = arm_position + np.clip(step.reshape(count, -1), -bound, bound)
        kept: Array = np.clip(moved, self.lower, self.upper)
        return kept

    def solve(self, arm_position: Array, target: Array, *, steps: int = 60, dt: float = 0.1) -> Array:
        """Repeats `solve_step`: postures (n, 14) whose wrists are at, or as near as they get to, `target` (n, 2, 3)."""
        for _ in range(steps):
            arm_position = self.solve_step(arm_position, target, dt)
        return arm_position

    def torso_in_heading(
        self, waist: Array, pelvis_pitch: Array, pelvis_roll: Array | None = None
    ) -> tuple[Array, Array]:
        """Rotation (n, 3, 3) and position (n, 3) [m] of the torso frame in the heading frame at the base.

        `waist` (n, 3): yaw, roll, pitch positions [rad], as in the chain; `pelvis_pitch`, `pelvis_roll` (n,) [rad].
        """
        roll = np.zeros_like(pelvis_pitch) if pelvis_roll is None else pelvis_roll
        rotation = rotations.matrix(rotations.from_euler(roll, pelvis_pitch, np.zeros_like(pelvis_pitch)))
        position = np.zeros((len(waist), 3))
        for j, (offset, fixed, axis) in enumerate(self._waist):
            position = position + rotation @ offset
            rotation = rotation @ fixed @ rotations.axis_matrix(axis, waist[:, j])
        return rotation, position


def _axis(body: Body) -> Array:
    if body.hinge is None:
        raise ValueError(f"body {body.name!r} lies on a joint chain but has no hinge")
    return body.hinge.axis


def _rodrigues(axes: list[list[Array]]) -> tuple[Array, Array]:
    """Skew matrices K and K² of the axes, shapes (joints, 2, 3, 3): R = 1 + sin K + (1 - cos) K²."""
    skew = np.array([[[[0, -z, y], [z, 0, -x], [-y, x, 0]] for x, y, z in chain] for chain in axes], dtype=np.float64)
    skew = np.swapaxes(skew, 0, 1)
    return skew, skew @ skew
