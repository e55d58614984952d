"""Gauss-Newton steps under constraints: a step, linearised cost of a posture, and the static method of labelling."""

from dataclasses import dataclass

import daqp
import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.errors import Rejected
from iowbc.reference.labels.support_model import Posture, Sample, SupportModel, ground_forces
from iowbc.robot.description import GRAVITY

REGULARISATION = 1e-9
"""Added to the reduced Hessian, relative to its largest entry: the QP solver needs it positive definite."""
UNBOUNDED = 1e30
"""daqp's value of an absent bound."""
SOLVED = 1
"""daqp's exit flag for an optimum."""


def constrained_step(
    gradient: Array, residual: Array, equality: Array, error: Array, rows: Array, lower: Array, upper: Array
) -> Array:
    """argmin ½|G s + r|² with E s = -e and lower ≤ R s ≤ upper, (n,). An orthogonal decomposition of Eᵀ eliminates the
    equalities and leaves a small dense QP. Raises `Rejected` where there is none."""
    count = len(error)
    orthogonal, triangle = np.linalg.qr(equality.T, mode="complete")
    particular = orthogonal[:, :count] @ np.linalg.solve(triangle[:count].T, -error)
    free = orthogonal[:, count:]
    reduced = gradient @ free
    hessian = reduced.T @ reduced
    hessian[np.diag_indices_from(hessian)] += REGULARISATION * hessian.max()
    linear = reduced.T @ (residual + gradient @ particular)
    shift = rows @ particular
    sense = np.zeros(len(rows), dtype=np.int32)
    solution, _, flag, _ = daqp.solve(hessian, linear, rows @ free, upper - shift, lower - shift, sense)
    if flag != SOLVED or not np.isfinite(solution).all():
        raise Rejected("infeasible")
    return particular + free @ solution


@dataclass(frozen=True)
class PostureCost:
    """Cost and equalities at a configuration, with derivatives by its tangent (21,)."""

    residual: Array
    """Centre of mass over the middle of the feet (2), height, torso rotation (3), support joints (15): (21,)."""
    gradient: Array
    """(21, 21)."""
    error: Array
    """Errors of both soles from their places, (12,)."""
    equality: Array
    """(12, 21)."""

    @classmethod
    def at(cls, support: SupportModel, q: Array, sample: Sample, rest: Array) -> "PostureCost":
        """The cost of configuration `q` (22,); `rest` (15,): reference of the posture cost."""
        model, data = support.model, support.data
        com_rows = pinocchio.jacobianCenterOfMass(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        base = pinocchio.getFrameJacobian(model, data, support.base, pinocchio.LOCAL_WORLD_ALIGNED)
        torso = pinocchio.getFrameJacobian(model, data, support.torso, pinocchio.LOCAL)
        com, of_com = data.com[0], support.height == "com"
        lift = com[2] if of_com else data.oMf[support.base].translation[2]
        turn = pinocchio.log3(sample.torso_rotation().T @ data.oMf[support.torso].rotation)
        angles = np.eye(len(rest), model.nv, 6)
        places = zip(support.soles, support.stance, strict=True)
        return cls(
            residual=np.concatenate([com[:2], [lift - sample.height], turn, q[7:] - rest]),
            gradient=np.concatenate([com_rows[:2], (com_rows if of_com else base)[2:3], torso[3:], angles]),
            error=np.concatenate([pinocchio.log6(place.actInv(data.oMf[sole])).vector for sole, place in places]),
            equality=np.concatenate(
                [pinocchio.getFrameJacobian(model, data, sole, pinocchio.LOCAL) for sole in support.soles]
            ),
        )


def cost_weights(support: SupportModel) -> tuple[Array, Array]:
    """Square roots of the weights of the residual: task (6,) and posture (15,)."""
    problem = support.problem
    task = [problem.com_weight] * 2 + [problem.height_weight] + [problem.torso_weight] * 3
    return np.sqrt(task), np.sqrt(support.posture_weights)


class StaticMethod:
    """The steady state of the optimal control problem (paper eq. 4): a posture in equilibrium with the least torque.

    Variables are the base pose, the support joints and the two sole wrenches; Gauss-Newton steps with the feet and the
    base's equilibrium as linearised equalities, and joint, torque and contact limits as inequalities. Solves samples
    one after the other; holds the model and its buffers.
    """

    def __init__(self, support: SupportModel) -> None:
        self.support, self.problem = support, support.problem
        self.joints, self.velocities = len(support.robot.support), support.model.nv
        self.size = self.velocities + 12
        self.start = support.start()
        task, posture = cost_weights(support)
        torque = np.sqrt(np.full(self.joints, support.problem.torque_weight))
        self.root_weight = np.concatenate([task, torque, posture])
        cone, bound = support.limits.rows()
        self.cone, self.cone_bound = np.kron(np.eye(2), cone), np.tile(bound, 2)
        self.angle_rows = np.eye(self.joints, self.size, 6)
        self.cone_rows = np.concatenate([np.zeros((len(self.cone), self.velocities)), self.cone], axis=1)
        self.weight = GRAVITY * sum(inertia.mass for inertia in support.full.inertias)

    def solve(self, sample: Sample) -> Posture:
        """The label of a sample. Raises `Rejected` with "infeasible" or "not converged"."""
        support, problem = self.support, self.problem
        support.lock(sample)
        rest = support.rest(sample)[7:]
        q, wrench = self.start.copy(), np.zeros((2, 6))
        wrench[:, 2] = 0.5 * self.weight
        for _ in range(problem.iterations):
            step = self._step(q, wrench, sample, rest)
            q = pinocchio.integrate(support.model, q, step[: self.velocities])
            wrench = wrench + step[self.velocities :].reshape(2, 6)
            if np.abs(step[: self.velocities]).max() < problem.tolerance:
                return Posture(q, wrench)
        raise Rejected("not converged")

    def equilibrium(
        self, q: Array, wrench: Array, sample: Sample, rest: Array
    ) -> tuple[PostureCost, Array, Array, Array, Array]:
        """Linearisation at (q, wrench): cost without torques, joint torques and their rows, equality rows and error."""
        support, nv = self.support, self.velocities
        forces = ground_forces(support.model, support.soles, wrench)
        by_position = pinocchio.computeStaticTorqueDerivatives(support.model, support.data, q, forces)
        static = support.data.tau.copy()
        cost = PostureCost.at(support, q, sample, rest)
        soles = cost.equality
        by_wrench = np.concatenate([-soles[:6].T, -soles[6:].T], axis=1)  # of base and joint torques, (21, 12)
        equality = np.zeros((18, self.size))
        equality[:12, :nv], equality[12:, :nv], equality[12:, nv:] = soles, by_position[:6], by_wrench[:6]
        torque_rows = np.concatenate([by_position[6:], by_wrench[6:]], axis=1)
        return cost, static[6:], torque_rows, equality, np.concatenate([cost.error, static[:6]])

    def _step(self, q: Array, wrench: Array, sample: Sample, rest: Array) -> Array:
        """One Gauss-Newton step at (q, wrench): tangent (21,) and change of the wrenches (12,)."""
        support, nv, largest = self.support, self.velocities, self.problem.largest_step
        cost, torque, torque_rows, equality, error = self.equilibrium(q, wrench, sample, rest)
        gradient = np.zeros((6 + 2 * self.joints, self.size))
        gradient[:6, :nv], gradient[6 + self.joints :, :nv] = cost.gradient[:6], cost.gradient[6:]
        gradient[6 : 6 + self.joints] = torque_rows
        residual = np.concatenate([cost.residual[:6], torque, cost.residual[6:]])
        least, most = np.maximum(support.lower - q[7:], -largest), np.minimum(support.upper - q[7:], largest)
        lower = np.concatenate([least, -support.effort - torque, np.full(len(self.cone), -UNBOUNDED)])
        upper = np.concatenate([most, support.effort - torque, self.cone_bound - self.cone @ wrench.ravel()])
        rows = np.concatenate([self.angle_rows, torque_rows, self.cone_rows])
        gradient, residual = self.root_weight[:, None] * gradient, self.root_weight * residual
        return constrained_step(gradient, residual, equality, error, rows, lower, upper)
