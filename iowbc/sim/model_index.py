"""Indices into a compiled model."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from iowbc.arrays import Indices, as_slice
from iowbc.robot.description import Robot
from iowbc.sim.objects import HANDS

BASE_LINEAR = slice(0, 3)
BASE_ANGULAR = slice(3, 6)


class ModelIndex:
    """Indices into the arrays of a model and of its data. The robot comes first, then the object."""

    def __init__(self, model: Any, robot: Robot) -> None:
        """Finds everything by name; checks that the joints are in the robot's order."""
        names = [model.joint(index).name for index in range(model.njnt)]
        count = len(robot.joints)
        if tuple(names[1 : count + 1]) != robot.joints:
            raise ValueError(f"{robot.mjcf}: joints compile to {names}, expected a free joint and then {robot.joints}")
        bodies = {model.body(index).name: index for index in range(model.nbody)}
        sites = {model.site(index).name: index for index in range(model.nsite)}
        geoms = {model.geom(index).name: index for index in range(model.ngeom)}
        self.joints = slice(7, 7 + count)
        """Robot's joint positions in qpos."""
        self.joint_speeds = slice(6, 6 + count)
        """Robot's joint velocities in qvel."""
        self.object: int | None = bodies.get("object")
        """Body of the object."""
        self.object_position = None if self.object is None else slice(7 + count, model.nq)
        """Object in qpos: a pose, or x, y and yaw of a crate."""
        self.base, self.torso = bodies[robot.base], bodies[robot.torso]
        self.feet = _places(bodies, robot.sole_bodies)
        """Bodies of the feet, (2,)."""
        self.hands = _places(bodies, robot.wrist_bodies if self.object is None else HANDS)
        """Bodies of the hands, (2,); without an object those of the wrists."""
        self.wrists = _places(bodies, robot.wrist_bodies)
        """Bodies of the wrists, (2,)."""
        self.links = _places(bodies, robot.tree.bodies)
        """Bodies of the robot's own description, in its order."""
        self.soles, self.grips = _places(sites, robot.soles), _places(sites, robot.wrists)
        """Sites of the soles and of the grips, (2,)."""
        self.object_grips = _pair(sites, "object_left_grip", "object_right_grip")
        """Sites on the object to which the grips are connected, (2,)."""
        feet = [bodies[name] for name in robot.sole_bodies]
        self.foot_geoms = np.flatnonzero(np.isin(model.geom_bodyid, feet) & (model.geom_conaffinity != 0))
        """Contact points of the feet."""
        self.palms = _pair(geoms, "left_palm", "right_palm")
        """Geoms of the palms, (2,)."""
        self.object_geom: int | None = geoms.get("object")
        """Geom with which the object touches palms."""


def _places(indices: dict[str, int], names: Iterable[str]) -> slice | Indices:
    return as_slice(np.array([indices[name] for name in names]))


def _pair(indices: dict[str, int], left: str, right: str) -> Indices | None:
    return np.array([indices[left], indices[right]]) if left in indices else None
