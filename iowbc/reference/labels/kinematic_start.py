"""A posture that meets a command by kinematics alone: where the optimal control problem begins."""

from typing import Literal

import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.reference.labels.constrained_step import constrained_step
from iowbc.reference.labels.sample import Sample
from iowbc.reference.labels.support_model import SupportModel, posture_weights


class KinematicStart:
    """Feet in place, centre of mass over their middle, height and torso as commanded, near the default posture."""

    def __init__(self, support: SupportModel, height: Literal["pelvis", "com"]) -> None:
        self.support, self.height = support, height
        problem = support.problem
        task = [problem.com_weight] * 2 + [problem.height_weight] + [problem.torso_weight] * 3
        self.angle_rows = np.eye(len(support.robot.support), support.model.nv, 6)
        self.weight = np.sqrt(np.concatenate([task, posture_weights(support.robot, problem)]))

    def posture(self, sample: Sample) -> Array:
        """Configuration (22,) of the support model, which must be locked to the sample.

        Gauss-Newton steps on the cost without torques, with the feet as linearised equalities and the joint ranges.
        Raises `Rejected` where the feet cannot stay in place.
        """
        support, problem = self.support, self.support.problem
        q, largest = support.rest(sample), problem.largest_step
        rest = q[7:].copy()
        for _ in range(problem.iterations):
            gradient, residual, equality, error = self._linearise(q, sample, rest)
            lower, upper = np.maximum(support.lower - q[7:], -largest), np.minimum(support.upper - q[7:], largest)
            step = constrained_step(gradient, residual, equality, error, self.angle_rows, lower, upper)
            q = pinocchio.integrate(support.model, q, step)
            if np.abs(step).max() < problem.tolerance:
                break
        return q

    def _linearise(self, q: Array, sample: Sample, rest: Array) -> tuple[Array, Array, Array, Array]:
        support, model, data = self.support, self.support.model, self.support.data
        com_rows = pinocchio.jacobianCenterOfMass(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        base = pinocchio.getFrameJacobian(model, data, support.base, pinocchio.LOCAL_WORLD_ALIGNED)
        torso = pinocchio.getFrameJacobian(model, data, support.torso, pinocchio.LOCAL)
        com, of_com = data.com[0], self.height == "com"
        lift = com[2] if of_com else data.oMf[support.base].translation[2]
        turn = pinocchio.log3(sample.torso_rotation().T @ data.oMf[support.torso].rotation)
        gradient = np.concatenate([com_rows[:2], (com_rows if of_com else base)[2:3], torso[3:], self.angle_rows])
        residual = np.concatenate([com[:2], [lift - sample.height], turn, q[7:] - rest])
        equality = np.concatenate([pinocchio.getFrameJacobian(model, data, f, pinocchio.LOCAL) for f in support.soles])
        error = np.concatenate(
            [
                pinocchio.log6(place.actInv(data.oMf[sole])).vector
                for sole, place in zip(support.soles, support.stance, strict=True)
            ]
        )
        return self.weight[:, None] * gradient, self.weight * residual, equality, error
