"""The cost of a posture without torques, linearised; and the posture that meets a command by kinematics alone."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.reference.labels.constrained_step import constrained_step
from iowbc.reference.labels.sample import Sample
from iowbc.reference.labels.support_model import SupportModel, posture_weights


@dataclass(frozen=True)
class PostureCost:
    """Cost and equalities at a configuration, with derivatives by its tangent (21,)."""

    residual: Array
    """Centre of mass over the middle of the feet (2), height, torso rotation (3), support joints (15): (21,)."""
    gradient: Array
    """(21, 21)."""
    error: Array
    """Both soles from their places, (12,)."""
    equality: Array
    """(12, 21)."""

    @classmethod
    def at(
        cls, support: SupportModel, height: Literal["pelvis", "com"], q: Array, sample: Sample, rest: Array
    ) -> "PostureCost":
        """The cost of configuration `q` (22,); `rest` (15,): joints that the posture is drawn to."""
        model, data = support.model, support.data
        com_rows = pinocchio.jacobianCenterOfMass(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        base = pinocchio.getFrameJacobian(model, data, support.base, pinocchio.LOCAL_WORLD_ALIGNED)
        torso = pinocchio.getFrameJacobian(model, data, support.torso, pinocchio.LOCAL)
        com, of_com = data.com[0], height == "com"
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
    """Roots of the weights of the residual: those of the task (6,), and of the posture (15,)."""
    problem = support.problem
    task = [problem.com_weight] * 2 + [problem.height_weight] + [problem.torso_weight] * 3
    return np.sqrt(task), np.sqrt(posture_weights(support.robot, problem))


class KinematicStart:
    """Feet in place, centre of mass over their middle, height and torso as commanded, near the default posture."""

    def __init__(self, support: SupportModel, height: Literal["pelvis", "com"]) -> None:
        self.support, self.height = support, height
        self.weight = np.concatenate(cost_weights(support))

    def posture(self, sample: Sample) -> Array:
        """Configuration (22,) of the support model, which must be locked to the sample.

        Gauss-Newton steps on the cost without torques, with the feet as linearised equalities and the joint ranges.
        Raises `Rejected` where the feet cannot stay in place.
        """
        support, problem = self.support, self.support.problem
        q, largest = support.rest(sample), problem.largest_step
        rest = q[7:].copy()
        for _ in range(problem.iterations):
            cost = PostureCost.at(support, self.height, q, sample, rest)
            gradient, residual = self.weight[:, None] * cost.gradient, self.weight * cost.residual
            lower, upper = np.maximum(support.lower - q[7:], -largest), np.minimum(support.upper - q[7:], largest)
            step = constrained_step(gradient, residual, cost.equality, cost.error, cost.gradient[6:], lower, upper)
            q = pinocchio.integrate(support.model, q, step)
            if np.abs(step).max() < problem.tolerance:
                break
        return q
