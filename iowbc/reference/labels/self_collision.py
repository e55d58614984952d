"""Distances between the capsules of links that may touch, for a posture of the whole robot."""

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.robot.description import Robot

Array = NDArray[Any]


class SelfCollision:
    """All pairs of capsules whose bodies are neither the same, nor parent and child, nor excluded by the MJCF."""

    def __init__(self, robot: Robot) -> None:
        bodies = robot.tree.bodies
        shapes = [(name, capsule) for name, body in bodies.items() for capsule in body.capsules]
        joints = {hinge.name: index for index, hinge in enumerate(robot.tree.hinges())}
        self.names = tuple(capsule.name for _, capsule in shapes)
        self._joint = [joints[hinge.name] + 2 if (hinge := bodies[name].hinge) else 1 for name, _ in shapes]
        self._ends = np.array([[capsule.start, capsule.end] for _, capsule in shapes])
        radius = np.array([capsule.radius for _, capsule in shapes])
        pairs = [
            (a, b) for a, b in combinations(range(len(shapes)), 2) if _may_touch(robot, shapes[a][0], shapes[b][0])
        ]
        self.pairs = np.array(pairs)
        self._radii = radius[self.pairs].sum(axis=1)

    def clearance(self, placements: Any) -> tuple[float, str]:
        """Least distance [m] (negative: overlap) and the pair's names, from pinocchio's joint placements `oMi`."""
        rotation = np.array([placements[joint].rotation for joint in self._joint])
        origin = np.array([placements[joint].translation for joint in self._joint])
        ends = np.einsum("sij,skj->ski", rotation, self._ends) + origin[:, None]
        first, second = ends[self.pairs[:, 0]], ends[self.pairs[:, 1]]
        distance = segment_distance(first[:, 0], first[:, 1], second[:, 0], second[:, 1]) - self._radii
        nearest = int(np.argmin(distance))
        a, b = self.pairs[nearest]
        return float(distance[nearest]), f"{self.names[a]} and {self.names[b]}"


def segment_distance(start_a: Array, end_a: Array, start_b: Array, end_b: Array) -> Array:
    """Distance between segments, row by row; shapes (n, 3), a segment may be a point.

    Ericson, Real-Time Collision Detection, 5.1.9.
    """
    along_a, along_b, between = end_a - start_a, end_b - start_b, start_a - start_b
    a, e = _dot(along_a, along_a), _dot(along_b, along_b)
    b, c, f = _dot(along_a, along_b), _dot(along_a, between), _dot(along_b, between)
    length_a, length_b = np.where(a > 0.0, a, 1.0), np.where(e > 0.0, e, 1.0)
    parallel = a * e - b * b
    s = np.where(parallel > 1e-12, np.clip((b * f - c * e) / np.where(parallel > 1e-12, parallel, 1.0), 0.0, 1.0), 0.0)
    t = np.where(e > 0.0, np.clip((b * s + f) / length_b, 0.0, 1.0), 0.0)
    s = np.where(a > 0.0, np.clip((b * t - c) / length_a, 0.0, 1.0), 0.0)
    gap = between + s[:, None] * along_a - t[:, None] * along_b
    distance: Array = np.sqrt(_dot(gap, gap))
    return distance


def _dot(a: Array, b: Array) -> Array:
    product: Array = np.einsum("ni,ni->n", a, b)
    return product


def _may_touch(robot: Robot, a: str, b: str) -> bool:
    bodies = robot.tree.bodies
    related = a == b or bodies[a].parent == b or bodies[b].parent == a
    return not related and frozenset((a, b)) not in robot.tree.excluded
