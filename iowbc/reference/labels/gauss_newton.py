"""Gauss-Newton steps under constraints: linearised cost of a posture, a step, and a start from kinematics alone."""

from dataclasses import dataclass

import daqp
import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.errors import Rejected
from iowbc.reference.labels.support_model import Sample, SupportModel, posture_weights

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
    return np.sqrt(task), np.sqrt(posture_weights(support.robot, problem))


def kinematic_start(support: SupportModel, sample: Sample) -> Array:
    """Configuration (22,) with the feet in place, the centre of mass over their middle, height and torso as commanded,
    near the default posture, by Gauss-Newton steps on the cost without torques, with the feet as linearised equalities
    and the joint ranges. The support model must be locked to the sample. Raises `Rejected` if the feet cannot stay."""
    problem, weight = support.problem, np.concatenate(cost_weights(support))
    q, largest = support.rest(sample), problem.largest_step
    rest = q[7:].copy()
    for _ in range(problem.iterations):
        cost = PostureCost.at(support, q, sample, rest)
        gradient, residual = weight[:, None] * cost.gradient, weight * cost.residual
        lower, upper = np.maximum(support.lower - q[7:], -largest), np.minimum(support.upper - q[7:], largest)
        step = constrained_step(gradient, residual, cost.equality, cost.error, cost.gradient[6:], lower, upper)
        q = pinocchio.integrate(support.model, q, step)
        if np.abs(step).max() < problem.tolerance:
            break
    return q
