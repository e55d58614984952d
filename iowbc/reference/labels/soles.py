"""Limits of two soles on the ground: wrenches and support polygon."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull

from iowbc.arrays import Array
from iowbc.recipe.generator import PostureProblem
from iowbc.reference.labels.support_model import mean_stance
from iowbc.robot.description import Robot


@dataclass(frozen=True)
class SoleLimits:
    """Limits of one flat sole: friction pyramid, centre of pressure in a rectangle, torsion, least load."""

    friction: float
    half_length: float
    half_width: float
    """Half sides of the rectangle for the centre of pressure [m]."""
    smallest_load: float
    """Least normal force [N]."""

    def rows(self) -> tuple[Array, Array]:
        """A and b of A f ≤ b for a wrench f (force, moment) in the sole's frame, shapes (17, 6) and (17,).

        The friction coefficient is that of the pyramid inside the cone, μ/√2. The yaw rows bound the torsion that four
        corner forces inside that pyramid can make (Caron, Pham, Nakamura, ICRA 2015).
        """
        x, y, mu = self.half_length, self.half_width, self.friction / np.sqrt(2.0)
        pyramid = [[1, 0, -mu, 0, 0, 0], [-1, 0, -mu, 0, 0, 0], [0, 1, -mu, 0, 0, 0], [0, -1, -mu, 0, 0, 0]]
        pressure = [[0, 0, -y, 1, 0, 0], [0, 0, -y, -1, 0, 0], [0, 0, -x, 0, 1, 0], [0, 0, -x, 0, -1, 0]]
        torsion = [
            [a * y, b * x, -mu * (x + y), -turn * a * mu, -turn * b * mu, -turn]
            for turn, a, b in product((1.0, -1.0), repeat=3)
        ]
        rows = np.array([*pyramid, *pressure, *torsion, [0, 0, -1, 0, 0, 0]], dtype=np.float64)
        bound = np.zeros(len(rows))
        bound[-1] = -self.smallest_load
        return rows, bound


def sole_limits(robot: Robot, problem: PostureProblem) -> SoleLimits:
    """Limits of both soles: the rectangle inside the contact points, shrunk by the recipe."""
    half_length, half_width = problem.sole_fraction * np.abs(robot.sole_polygon).min(axis=(0, 1))
    return SoleLimits(problem.friction, float(half_length), float(half_width), problem.smallest_load)


def support_edges(robot: Robot, problem: PostureProblem) -> tuple[Array, Array]:
    """Inward normals n (edges, 2) and offsets d (edges,) [m] of both soles' convex hull: distance inside is n·p + d."""
    corners = robot.sole_polygon + mean_stance(problem.stance_width)[:, None, :2]
    equations = np.unique(ConvexHull(corners.reshape(-1, 2)).equations.round(12), axis=0)
    return -equations[:, :2], -equations[:, 2]


def support_margin(edges: tuple[Array, Array], point: Array) -> Array:
    """Distance of points (..., 2) to the nearest edge, positive inside [m]."""
    normals, offsets = edges
    return (point @ normals.T + offsets).min(axis=-1)
