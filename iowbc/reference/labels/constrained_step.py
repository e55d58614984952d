"""One step of constrained least squares: what every method here solves again and again."""

import daqp
import numpy as np

from iowbc.arrays import Array
from iowbc.errors import Rejected

REGULARISATION = 1e-9
"""Added to the reduced Hessian, relative to its largest entry: the QP solver needs it positive definite."""
UNBOUNDED = 1e30
"""A bound that daqp takes for none."""
SOLVED = 1
"""daqp's exit flag of an optimum."""


def constrained_step(
    gradient: Array, residual: Array, equality: Array, error: Array, rows: Array, lower: Array, upper: Array
) -> Array:
    """argmin ½|G s + r|² with E s = -e and lower ≤ R s ≤ upper, shape (n,). Raises `Rejected` where there is none.

    The equalities are eliminated by an orthogonal decomposition of Eᵀ; what is left is a small dense QP.
    """
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
