"""The steady state of the optimal control problem (paper eq. 4): the least-torque posture in equilibrium on two soles.

Variables are the base pose, the support joints and the two sole wrenches; Gauss-Newton steps with the feet and the
base's equilibrium as linearised equalities, and joint, torque and contact limits as inequalities.
"""

from typing import Any, Literal

import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.errors import Rejected
from iowbc.recipe.generator import PostureProblem
from iowbc.reference.labels.constrained_step import UNBOUNDED, constrained_step
from iowbc.reference.labels.sample import Posture, Sample
from iowbc.reference.labels.soles import sole_limits
from iowbc.reference.labels.support_model import SupportModel, posture_weights
from iowbc.robot.description import GRAVITY


class StaticMethod:
    """Solves samples one after the other; holds the model and its buffers."""

    def __init__(self, support: SupportModel, height: Literal["pelvis", "com"]) -> None:
        self.support, self.height = support, height
        problem, self.joints = support.problem, len(support.robot.support)
        self.problem: PostureProblem = problem
        self.velocities = support.model.nv
        self.size = self.velocities + 12
        self.start = support.start()
        posture = posture_weights(support.robot, problem)
        self.root_weight = np.sqrt(
            np.concatenate(
                [
                    np.full(2, problem.com_weight),
                    [problem.height_weight],
                    np.full(3, problem.torso_weight),
                    np.full(self.joints, problem.torque_weight),
                    posture,
                ]
            )
        )
        cone, bound = sole_limits(support.robot, problem).rows()
        self.cone = np.kron(np.eye(2), cone)
        self.cone_bound = np.tile(bound, 2)
        self.angle_rows = np.eye(self.joints, self.size, 6)
        self.cone_rows = np.concatenate([np.zeros((len(self.cone), self.velocities)), self.cone], axis=1)
        total = sum(inertia.mass for inertia in support.full.inertias)
        self.weight = GRAVITY * total

    def solve(self, sample: Sample) -> Posture:
        """The label of a sample. Raises `Rejected` with "infeasible" or "not converged"."""
        support, problem = self.support, self.problem
        support.lock(sample)
        rest = support.rest(sample)[7:]
        torso = pinocchio.SE3(sample.torso_rotation(), np.zeros(3))
        q = self.start.copy()
        wrench = np.zeros((2, 6))
        wrench[:, 2] = 0.5 * self.weight
        for _ in range(problem.iterations):
            step, forces = self._step(q, wrench, sample, rest, torso)
            q = pinocchio.integrate(support.model, q, step)
            wrench = wrench + forces
            if np.abs(step).max() < problem.tolerance:
                return Posture(q, wrench)
        raise Rejected("not converged")

    def _step(self, q: Array, wrench: Array, sample: Sample, rest: Array, torso: Any) -> tuple[Array, Array]:
        """One Gauss-Newton step: tangent (21,) and change of the wrenches (2, 6)."""
        support, nv = self.support, self.velocities
        residual, gradient, torque, torque_rows, equality, error = self._linearise(q, wrench, sample, rest, torso)
        angle, largest = q[7:], self.problem.largest_step
        rows = np.concatenate([self.angle_rows, torque_rows, self.cone_rows])
        lower = np.concatenate(
            [np.maximum(support.lower - angle, -largest), -support.effort - torque, np.full(len(self.cone), -UNBOUNDED)]
        )
        upper = np.concatenate(
            [
                np.minimum(support.upper - angle, largest),
                support.effort - torque,
                self.cone_bound - self.cone @ wrench.ravel(),
            ]
        )
        step = constrained_step(gradient, residual, equality, error, rows, lower, upper)
        return step[:nv], step[nv:].reshape(2, 6)

    def _linearise(
        self, q: Array, wrench: Array, sample: Sample, rest: Array, torso: Any
    ) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Weighted residual and its Jacobian, joint torques and theirs, equality Jacobian and error, at (q, wrench)."""
        support, nv, joints = self.support, self.velocities, self.joints
        model, data = support.model, support.data
        by_position = pinocchio.computeStaticTorqueDerivatives(model, data, q, support.external(wrench))
        static = data.tau.copy()
        com_rows = pinocchio.jacobianCenterOfMass(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        equality, error = np.zeros((18, self.size)), np.empty(18)
        for side, (sole, place) in enumerate(zip(support.soles, support.stance, strict=True)):
            jacobian = pinocchio.getFrameJacobian(model, data, sole, pinocchio.LOCAL)
            rows = slice(6 * side, 6 * side + 6)
            equality[rows, :nv] = jacobian
            error[rows] = pinocchio.log6(place.actInv(data.oMf[sole])).vector
            equality[12:, nv + 6 * side : nv + 6 * side + 6] = -jacobian[:, :6].T
        equality[12:, :nv] = by_position[:6]
        error[12:] = static[:6]
        torque_rows = np.zeros((joints, self.size))
        torque_rows[:, :nv] = by_position[6:]
        torque_rows[:, nv : nv + 6] = -equality[:6, 6:nv].T
        torque_rows[:, nv + 6 :] = -equality[6:12, 6:nv].T

        gradient = np.zeros((6 + 2 * joints, self.size))
        gradient[:2, :nv] = com_rows[:2]
        base = pinocchio.getFrameJacobian(model, data, support.base, pinocchio.LOCAL_WORLD_ALIGNED)
        gradient[2, :nv] = com_rows[2] if self.height == "com" else base[2]
        gradient[3:6, :nv] = pinocchio.getFrameJacobian(model, data, support.torso, pinocchio.LOCAL)[3:]
        gradient[6 : 6 + joints] = torque_rows
        gradient[6 + joints :, 6:nv] = np.eye(joints)
        com = data.com[0]
        height = com[2] if self.height == "com" else data.oMf[support.base].translation[2]
        residual = np.concatenate(
            [
                com[:2],
                [height - sample.height],
                pinocchio.log3(torso.rotation.T @ data.oMf[support.torso].rotation),
                static[6:],
                q[7:] - rest,
            ]
        )
        weighted = self.root_weight[:, None] * gradient
        return self.root_weight * residual, weighted, static[6:], torque_rows, equality, error
