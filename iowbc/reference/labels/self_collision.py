"""Distances between the capsules of links that may touch, for a posture of the whole robot, by pinocchio with coal."""

from itertools import combinations
from typing import Any

import coal
import numpy as np
import pinocchio

from iowbc.robot.description import Robot
from iowbc.robot.mjcf import Capsule


class SelfCollision:
    """All pairs of capsules that are neither fixed to each other, nor a joint apart, nor excluded by the MJCF."""

    def __init__(self, robot: Robot, model: Any) -> None:
        self._model, self._geometry = model, pinocchio.GeometryModel()
        shapes = [(body, capsule) for body in robot.tree.bodies.values() for capsule in body.capsules]
        for body, capsule in shapes:
            frame = model.frames[model.getFrameId(body.name, pinocchio.FrameType.BODY)]
            placement, shape = _placed(capsule)
            self._geometry.addGeometryObject(
                pinocchio.GeometryObject(capsule.name, frame.parentJoint, frame.placement * placement, shape)
            )
        self.names = tuple(capsule.name for _, capsule in shapes)
        self.pairs = [
            (a, b)
            for a, b in combinations(range(len(shapes)), 2)
            if _may_touch(robot, shapes[a][0].name, shapes[b][0].name)
        ]
        for a, b in self.pairs:
            self._geometry.addCollisionPair(pinocchio.CollisionPair(a, b))
        self._found = self._geometry.createData()

    def clearance(self, data: Any) -> tuple[float, str]:
        """Least distance [m] (negative: overlap) and the pair's names, after forward kinematics in `data`."""
        pinocchio.updateGeometryPlacements(self._model, data, self._geometry, self._found)
        nearest = pinocchio.computeDistances(self._geometry, self._found)
        a, b = self.pairs[nearest]
        return float(self._found.distanceResults[nearest].min_distance), f"{self.names[a]} and {self.names[b]}"


def _placed(capsule: Capsule) -> tuple[Any, Any]:
    """Place in the body's frame and shape of a capsule; coal's lies along z, about its middle."""
    middle, along = 0.5 * (capsule.start + capsule.end), capsule.end - capsule.start
    length = float(np.linalg.norm(along))
    if length == 0.0:
        return pinocchio.SE3(np.eye(3), middle), coal.Sphere(capsule.radius)
    turn = pinocchio.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), along / length)
    return pinocchio.SE3(turn.matrix(), middle), coal.Capsule(capsule.radius, length)


def _may_touch(robot: Robot, a: str, b: str) -> bool:
    """True for two bodies that are checked for collision; what is fixed to a body is as near to others as that one."""
    tree = robot.tree
    movers = [tree.mover(name) for name in (a, b)]
    inward = [None if body.parent is None else tree.mover(body.parent).name for body in movers]
    names = [body.name for body in movers]
    related = names[0] == names[1] or inward[0] == names[1] or inward[1] == names[0]
    return not related and frozenset((a, b)) not in tree.excluded
