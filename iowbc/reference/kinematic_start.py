"""A posture that meets a command by kinematics alone: where the optimal control problem begins."""

from typing import Any, Literal

import numpy as np
import pinocchio
from numpy.typing import NDArray

from iowbc.reference.costs import posture_weights
from iowbc.reference.sample import Sample
from iowbc.reference.support_model import SupportModel

Array = NDArray[Any]


class KinematicStart:
    """Feet in place, centre of mass over their middle, height and torso as commanded, near the default posture."""

    def __init__(self, support: SupportModel, height: Literal["pelvis", "com"]) -> None:
        self.support, self.height = support, height
        self.rest = support.start()
        problem = support.problem
        task = [problem.com_weight] * 2 + [problem.height_weight] + [problem.torso_weight] * 3
        self.weight = np.sqrt(np.concatenate([task, posture_weights(support.robot, problem)]))

    def posture(self, sample: Sample) -> Array:
        """Configuration (22,) of the support model, which must be locked to the sample.

        Gauss-Newton steps on the cost without torques, feet as linearised equalities, joints clipped to ranges.
        """
        support, problem = self.support, self.support.problem
        q = self.rest.copy()
        for _ in range(problem.iterations):
            gradient, residual, equality, error = self._linearise(q, sample)
            orthogonal, triangle = np.linalg.qr(equality.T, mode="complete")
            count = len(error)
            particular = orthogonal[:, :count] @ np.linalg.solve(triangle[:count].T, -error)
            free = orthogonal[:, count:]
            solution = np.linalg.lstsq(gradient @ free, -(residual + gradient @ particular), rcond=None)[0]
            step = particular + free @ solution
            size = float(np.abs(step).max())
            q = pinocchio.integrate(support.model, q, step * min(1.0, problem.largest_step / max(size, 1e-12)))
            q[7:] = np.clip(q[7:], support.lower, support.upper)
            if size < problem.tolerance:
                break
        return q

    def _linearise(self, q: Array, sample: Sample) -> tuple[Array, Array, Array, Array]:
        support, model, data = self.support, self.support.model, self.support.data
        com_rows = pinocchio.jacobianCenterOfMass(model, data, q)
        pinocchio.updateFramePlacements(model, data)
        base = pinocchio.getFrameJacobian(model, data, support.base, pinocchio.LOCAL_WORLD_ALIGNED)
        torso = pinocchio.getFrameJacobian(model, data, support.torso, pinocchio.LOCAL)
        joints = np.concatenate([np.zeros((len(q) - 7, 6)), np.eye(len(q) - 7)], axis=1)
        com, of_com = data.com[0], self.height == "com"
        lift = com[2] if of_com else data.oMf[support.base].translation[2]
        turn = pinocchio.log3(sample.torso_rotation().T @ data.oMf[support.torso].rotation)
        gradient = np.concatenate([com_rows[:2], (com_rows if of_com else base)[2:3], torso[3:], joints])
        residual = np.concatenate([com[:2], [lift - sample.height], turn, (q - self.rest)[7:]])
        equality = np.concatenate([pinocchio.getFrameJacobian(model, data, f, pinocchio.LOCAL) for f in support.soles])
        error = np.concatenate(
            [
                pinocchio.log6(place.actInv(data.oMf[sole])).vector
                for sole, place in zip(support.soles, support.stance, strict=True)
            ]
        )
        return self.weight[:, None] * gradient, self.weight * residual, equality, error
