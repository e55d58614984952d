"""Inverse dynamics as a quadratic program: joint torques that stand on both soles and follow height, pitch and posture.

Variables are the accelerations of base and support joints and the wrench of the ground on each sole. The arms are
locked in their reference, and there is no load.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.recipe.evaluation.baselines import ModelBased
from iowbc.recipe.generator import PostureProblem
from iowbc.reference.labels.gauss_newton import UNBOUNDED, constrained_step
from iowbc.reference.labels.support_model import Sample, SupportModel
from iowbc.robot.description import Robot

LIMITS = ("friction", "sole_fraction", "smallest_load", "limit_margin", "effort_fraction")
"""Physical limits shared with the labels of the reference generator."""
WORLD = pinocchio.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True)
class Solution:
    """Planned motion of the next control period."""

    acceleration: Array
    """Acceleration of base (local frame) and support joints, (21,) [m/s², rad/s²]."""
    torque: Array
    """Torque of the support joints, (15,) [N·m]."""
    wrench: Array
    """Wrench of the ground on each sole, sole frames, force then moment, (2, 6) [N, N·m]."""


class Balance:
    """Solves the program of one robot; holds the model and its buffers, but no state between calls."""

    def __init__(self, robot: Robot, settings: ModelBased) -> None:
        problem = PostureProblem(**{name: getattr(settings, name) for name in LIMITS})
        self.settings, self.support = settings, SupportModel(robot, problem)
        self.model, self.data = self.support.model, self.support.data
        self.joints, self.velocities = len(robot.support), self.model.nv
        cone, bound = self.support.limits.rows()
        self._cone, self._bound = np.kron(np.eye(2), cone), np.tile(bound, 2)
        support = robot.support.tolist()
        places = [[support.index(joint) for joint in pair] for pair in robot.linkages]
        unit = np.eye(self.joints)
        pairs = [unit[first] + sign * unit[second] for first, second in places for sign in (1.0, -1.0)]
        self._selection = np.array([*unit, *pairs])
        single, shared = self.support.effort.copy(), self.support.effort[[first for first, _ in places]]
        single[[joint for pair in places for joint in pair]] *= settings.linkage_share
        self._effort = np.concatenate([single, np.repeat(shared, 2)])

    def configuration(self, gravity: Array, joints: Array) -> Array:
        """Model configuration, (22,), in a frame with the base's heading and its origin midway between the soles.
        `gravity` (3,): its direction in the base frame; `joints` (15,): support joints [rad]."""
        up = -gravity / np.linalg.norm(gravity)
        forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
        forward /= np.linalg.norm(forward)
        rotation = np.stack([forward, np.cross(up, forward), up])
        q = np.concatenate([np.zeros(3), pinocchio.Quaternion(rotation).coeffs(), joints])
        pinocchio.framesForwardKinematics(self.model, self.data, q)
        q[:3] = -0.5 * sum(self.data.oMf[sole].translation for sole in self.support.soles)
        return q

    def velocity(self, q: Array, rates: Array) -> Array:
        """Model velocity, (21,), with the soles at rest on average. `rates`: of the base (base frame) and of the
        support joints, (3 + 15,) [rad/s]."""
        v = np.concatenate([np.zeros(3), rates])
        pinocchio.computeJointJacobians(self.model, self.data, q)
        pinocchio.updateFramePlacements(self.model, self.data)
        soles = [self._jacobian(sole)[:3] @ v for sole in self.support.soles]
        v[:3] = -0.5 * self.data.oMf[self.support.base].rotation.T @ sum(soles)
        return v

    def solve(self, q: Array, v: Array, arms: Array, command: Array, reference: Array) -> Solution:
        """Solution at (q, v). `arms` (14,) [rad]; `command`: height [m] and torso pitch [rad], (2,); `reference`:
        θ_S_ref, (15,) [rad]. Raises `Rejected` if the limits allow no motion."""
        sample, nv = Sample(arms, command), self.velocities
        self.support.lock(sample)
        pinocchio.computeAllTerms(self.model, self.data, q, v)
        pinocchio.forwardKinematics(self.model, self.data, q, v, np.zeros(nv))
        pinocchio.updateFramePlacements(self.model, self.data)
        bias = self.data.nle.copy()
        equality, error = self._equilibrium(v, bias)
        torque = np.concatenate([self.data.M[6:], -equality[:12, 6:nv].T], axis=1)
        gradient, residual = self._tasks(q, v, sample, reference)
        root = np.sqrt(self.settings.torque_weight)
        found = constrained_step(
            np.concatenate([*gradient, root * torque]),
            np.concatenate([*residual, root * bias[6:]]),
            equality,
            error,
            *self._limits(q, v, torque, bias[6:]),
        )
        return Solution(found[:nv], torque @ found + bias[6:], found[nv:].reshape(2, 6))

    def _equilibrium(self, v: Array, bias: Array) -> tuple[Array, Array]:
        """Equality rows and errors: both soles come to rest, and their wrenches move the base."""
        nv = self.velocities
        equality, error = np.zeros((18, nv + 12)), np.empty(18)
        for side, sole in enumerate(self.support.soles):
            rows = slice(6 * side, 6 * side + 6)
            jacobian = pinocchio.getFrameJacobian(self.model, self.data, sole, pinocchio.LOCAL)
            drift = pinocchio.getFrameAcceleration(self.model, self.data, sole, pinocchio.LOCAL).vector
            equality[rows, :nv] = jacobian
            error[rows] = drift + self.settings.contact_damping * (jacobian @ v)
            equality[12:, nv + 6 * side : nv + 6 * side + 6] = -jacobian[:, :6].T
        equality[12:, :nv] = self.data.M[:6]
        error[12:] = bias[:6]
        return equality, error

    def _tasks(self, q: Array, v: Array, sample: Sample, reference: Array) -> tuple[list[Array], list[Array]]:
        """Weighted rows and residuals of centre of mass, height, torso and posture."""
        settings, support, model, data, nv = self.settings, self.support, self.model, self.data, self.velocities
        frames = support.base, support.torso
        base, torso = map(self._jacobian, frames)
        lift, turn = (pinocchio.getFrameClassicalAcceleration(model, data, frame, WORLD) for frame in frames)
        pinocchio.centerOfMass(model, data, q, v, np.zeros(nv))
        com, speed, drift = data.com[0][:2].copy(), data.vcom[0][:2].copy(), data.acom[0][:2].copy()
        tasks = (
            (settings.com, pinocchio.jacobianCenterOfMass(model, data, q)[:2], -com, speed, drift),
            (settings.height, base[2:3], sample.height - q[2:3], base[2:3] @ v, lift.linear[2:]),
            (settings.torso, torso[3:], self._torso_error(sample), torso[3:] @ v, turn.angular),
            (settings.posture, np.eye(self.joints, nv, 6), reference - q[7:], v[6:], np.zeros(self.joints)),
        )
        roots = [np.sqrt(task.weight) for task, *_ in tasks]
        gradient = [root * np.pad(rows, ((0, 0), (0, 12))) for root, (_, rows, *_) in zip(roots, tasks, strict=True)]
        residual = [
            root * (drift - task.stiffness * error + task.damping * speed)
            for root, (task, _, error, speed, drift) in zip(roots, tasks, strict=True)
        ]
        return gradient, residual

    def _limits(self, q: Array, v: Array, torque: Array, bias: Array) -> tuple[Array, Array, Array]:
        """Rows and bounds: torques, also of pairs that share a linkage, joint ranges, and what the soles can carry.
        At a mechanical stop, the stop's torque adds to the motor's."""
        nv, time, support = self.velocities, self.settings.limit_time, self.support
        angle, ahead = q[7:], q[7:] + time * v[6:]
        cone = np.concatenate([np.zeros((len(self._cone), nv)), self._cone], axis=1)
        rows = np.concatenate([self._selection @ torque, np.eye(self.joints, nv + 12, 6), cone])
        held = self._selection @ bias
        on_stop = self.settings.stop_torque * np.stack([angle <= support.lower, angle >= support.upper])
        push, pull = self._effort + on_stop @ np.abs(self._selection).T
        least = np.minimum(2.0 / time**2 * (support.lower - ahead), 0.0)
        most = np.maximum(2.0 / time**2 * (support.upper - ahead), 0.0)
        lower = np.concatenate([-pull - held, least, np.full(len(cone), -UNBOUNDED)])
        return rows, lower, np.concatenate([push - held, most, self._bound])

    def _torso_error(self, sample: Sample) -> Array:
        """Rotation vector from the torso's orientation to the commanded one, world axes, (3,) [rad]."""
        forward = sum(self.data.oMf[sole].rotation[:, 0] for sole in self.support.soles)
        yaw = np.arctan2(forward[1], forward[0])
        wanted_rotation = pinocchio.utils.rotate("z", yaw) @ sample.torso_rotation()
        return pinocchio.log3(wanted_rotation @ self.data.oMf[self.support.torso].rotation.T)

    def _jacobian(self, frame: int) -> Any:
        return pinocchio.getFrameJacobian(self.model, self.data, frame, WORLD)
