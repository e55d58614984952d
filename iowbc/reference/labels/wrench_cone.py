"""Which wrenches a flat sole can carry: friction pyramid, centre of pressure in a rectangle, torsion, least load."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.recipe.generator import Problem
from iowbc.robot.description import Robot

Array = NDArray[Any]


@dataclass(frozen=True)
class SoleLimits:
    """Contact of one sole."""

    friction: float
    """Friction coefficient."""
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
            for turn in (1.0, -1.0)
            for a in (1.0, -1.0)
            for b in (1.0, -1.0)
        ]
        load = [[0, 0, -1, 0, 0, 0]]
        rows = np.array([*pyramid, *pressure, *torsion, *load], dtype=np.float64)
        bound = np.zeros(len(rows))
        bound[-1] = -self.smallest_load
        return rows, bound


def sole_limits(robot: Robot, problem: Problem) -> SoleLimits:
    """Limits of both soles: the rectangle inside the contact points, shrunk by the recipe."""
    half_length, half_width = problem.sole_fraction * np.abs(robot.sole_polygon).min(axis=(0, 1))
    return SoleLimits(problem.friction, float(half_length), float(half_width), problem.smallest_load)
