"""The sole wrenches that hold a given posture with the least joint torques."""

from typing import Any

import numpy as np
import pinocchio
from numpy.typing import NDArray

from iowbc.reference.labels.constrained_step import UNBOUNDED, constrained_step
from iowbc.reference.labels.support_model import SupportModel
from iowbc.reference.labels.wrench_cone import SoleLimits

Array = NDArray[Any]


def distribute(support: SupportModel, configuration: Array, limits: SoleLimits) -> Array:
    """Wrenches (2, 6) in the soles' frames, in equilibrium with gravity. Raises `Rejected` where limits leave none."""
    model, data = support.model, support.data
    gravity = pinocchio.computeGeneralizedGravity(model, data, configuration).copy()
    pinocchio.computeJointJacobians(model, data, configuration)
    pinocchio.updateFramePlacements(model, data)
    transposed = np.concatenate(
        [pinocchio.getFrameJacobian(model, data, sole, pinocchio.LOCAL).T for sole in support.soles], axis=1
    )
    base, joints = transposed[:6], transposed[6:]
    cone, bound = limits.rows()
    rows, upper = np.kron(np.eye(2), cone), np.tile(bound, 2)
    lower = np.full(len(upper), -UNBOUNDED)
    return constrained_step(joints, -gravity[6:], base, -gravity[:6], rows, lower, upper).reshape(2, 6)
