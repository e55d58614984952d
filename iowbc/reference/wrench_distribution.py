"""The sole wrenches that hold a given posture with the least joint torques."""

from typing import Any

import daqp
import numpy as np
import pinocchio
from numpy.typing import NDArray

from iowbc.reference.sample import Rejected
from iowbc.reference.support_model import SupportModel
from iowbc.reference.wrench_cone import SoleLimits

Array = NDArray[Any]

REGULARISATION = 1e-9
SOLVED = 1


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
    orthogonal, triangle = np.linalg.qr(base.T, mode="complete")
    particular = orthogonal[:, :6] @ np.linalg.solve(triangle[:6].T, gravity[:6])
    free = orthogonal[:, 6:]
    rows = joints @ free
    hessian = rows.T @ rows
    hessian[np.diag_indices_from(hessian)] += REGULARISATION * hessian.max()
    linear = rows.T @ (joints @ particular - gravity[6:])
    cone, bound = limits.rows()
    both = np.zeros((2 * len(cone), 12))
    both[: len(cone), :6], both[len(cone) :, 6:] = cone, cone
    upper = np.tile(bound, 2) - both @ particular
    sense = np.zeros(len(upper), dtype=np.int32)
    solution, _, flag, _ = daqp.solve(hessian, linear, both @ free, upper, np.full(len(upper), -1e30), sense)
    if flag != SOLVED:
        raise Rejected("no equilibrium")
    wrench: Array = (particular + free @ solution).reshape(2, 6)
    return wrench
