"""Kinematics of both arms, many rows at once in NumPy: forward, Jacobian, damped differential IK (paper eq. 2, 3)."""

import numpy as np

from iowbc.arrays import Array
from iowbc.control.chain import Chain, turn
from iowbc.recipe.task.joint_references import ArmReference
from iowbc.robot.description import Robot
from iowbc.robot.mjcf import Body

X, Y = 0, 1
IDENTITY = np.eye(3)


def arm_chains(robot: Robot) -> tuple[list[tuple[Body, ...]], tuple[Body, ...]]:
    """Bodies of both arms from the torso outward, and those from the base to the torso.

    The torso is the body that moves: where its own is fixed to another, the frame is the other's.
    """
    torso = robot.tree.mover(robot.torso).name
    return [robot.tree.chain(body, torso) for body in robot.wrist_bodies], robot.tree.chain(torso, robot.base)


class ArmKinematics:
    """Both arms from the torso frame to the wrist sites; joints as in the interaction branch, left, then right."""

    def __init__(self, robot: Robot, settings: ArmReference | None = None) -> None:
        names = [robot.joints[index] for index in robot.interaction]
        chains, waist = arm_chains(robot)
        order = [names.index(body.hinge.name) for chain in chains for body in chain if body.hinge is not None]
        if order != list(range(len(names))):
            raise ValueError(f"{robot.folder}: the arm joints must be the left chain followed by the right one")
        self.rest = robot.default_position[robot.interaction]
        self.lower, self.upper = robot.lower[robot.interaction], robot.upper[robot.interaction]
        own = robot.velocity_limit[robot.interaction]
        self.settings = settings = settings or ArmReference()
        self.speed = own if settings.joint_speed is None else np.minimum(own, settings.joint_speed)
        self._chain, self._waist = Chain(chains), Chain([waist])
        self._grip = robot.grip_offset.T[:, :, None]

    def forward(self, arm_position: Array) -> tuple[Array, Array]:
        """Wrist positions (n, 2, 3) [m] in the torso frame, their Jacobian (n, 2, 3, joints of one)."""
        count, joints = len(arm_position), self._chain.length
        vectors = np.empty((3, joints + 1, 2, count))
        vectors[:, joints] = self._grip
        self._chain.carry(arm_position.reshape(count, 2, joints).transpose(2, 1, 0), vectors, joints)
        rows = np.ascontiguousarray(vectors.transpose(3, 2, 0, 1))
        return rows[..., joints], rows[..., :joints]

    def solve_step(self, arm_position: Array, target: Array, dt: float) -> Array:
        """One step of differential IK (paper eq. 3), damped, with the redundancy drawn to the rest posture.

        `arm_position` (n, arm joints) [rad]; `target` wrist positions (n, 2, 3) [m] in the torso frame; `dt` [s].
        next = q + J⁺e + (1 - J⁺J) k (rest - q) dt with J⁺ = Jᵀ(JJᵀ + λ² + ρ|e|)⁻¹ and e = x - FK(q), cut to its
        longest; kept to the joint ranges and the joint speed.
        """
        count, settings = len(arm_position), self.settings
        wrist, jacobian = self.forward(arm_position)
        transposed = jacobian.swapaxes(-1, -2)
        error = target - wrist
        distance = np.sqrt(np.vecdot(error, error))
        near = np.minimum(distance, settings.longest_step)
        error *= (settings.longest_step / np.maximum(distance, settings.longest_step))[..., None]
        damping = settings.damping**2 + settings.reach * near
        gram = jacobian @ transposed + damping[..., None, None] * IDENTITY
        posture = (settings.posture_gain * dt * (self.rest - arm_position)).reshape(count, 2, -1)
        wanted = error - np.einsum("nsij,nsj->nsi", jacobian, posture)
        step = posture + np.einsum("nsji,nsj->nsi", jacobian, np.linalg.solve(gram, wanted[..., None])[..., 0])
        bound = self.speed * dt
        moved = arm_position + step.reshape(count, -1).clip(-bound, bound)
        kept: Array = moved.clip(self.lower, self.upper)
        return kept

    def solve(self, arm_position: Array, target: Array, *, steps: int = 60, dt: float = 0.1) -> Array:
        """Repeats `solve_step`: postures whose wrists are at, or as near as they get to, `target` (n, 2, 3)."""
        for _ in range(steps):
            arm_position = self.solve_step(arm_position, target, dt)
        return arm_position

    def into_torso(self, waist: Array, pelvis_pitch: Array, points: Array) -> Array:
        """Points (n, k, 3) [m] of the heading frame at the base, as the torso frame sees them; the rest as below."""
        moved = points.transpose(2, 1, 0)[:, :, None].copy()
        turn(moved, Y, -pelvis_pitch[None])
        self._waist.fetch(waist.T[:, None], moved)
        seen: Array = moved[:, :, 0].transpose(2, 1, 0)
        return seen

    def torso_in_heading(
        self, waist: Array, pelvis_pitch: Array, pelvis_roll: Array | None = None
    ) -> tuple[Array, Array]:
        """Rotation (n, 3, 3) and position (n, 3) [m] of the torso frame in the heading frame at the base.

        `waist` (n, waist joints): positions [rad], as in the chain; `pelvis_pitch`, `pelvis_roll` (n,) [rad].
        """
        vectors = np.zeros((3, 4, 1, len(waist)))
        for axis in range(3):
            vectors[axis, axis] = 1.0
        self._waist.carry(waist.T[:, None], vectors)
        if pelvis_roll is not None:
            turn(vectors, X, pelvis_roll[None])
        turn(vectors, Y, pelvis_pitch[None])
        rows = np.ascontiguousarray(vectors[:, :, 0].transpose(2, 0, 1))
        return rows[..., :3], rows[..., 3]
