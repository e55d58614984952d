"""How far inside the support polygon a point of the ground lies."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from iowbc.recipe.generator import Problem
from iowbc.reference.labels.sample import mean_stance
from iowbc.robot.description import Robot

Array = NDArray[Any]


def support_edges(robot: Robot, problem: Problem) -> tuple[Array, Array]:
    """Inward normals n (edges, 2) and offsets d (edges,) [m] of both soles' convex hull: distance inside is n·p + d."""
    corners = robot.sole_polygon + mean_stance(problem.stance_width)[:, None, :2]
    equations = np.unique(ConvexHull(corners.reshape(-1, 2)).equations.round(12), axis=0)
    return -equations[:, :2], -equations[:, 2]


def support_margin(edges: tuple[Array, Array], point: Array) -> Array:
    """Distance of points (..., 2) to the nearest edge, positive inside [m]."""
    normals, offsets = edges
    margin: Array = (point @ normals.T + offsets).min(axis=-1)
    return margin
