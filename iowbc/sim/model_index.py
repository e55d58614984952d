"""Indices into a compiled model."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from iowbc.arrays import Indices, as_slice
from iowbc.robot.description import Robot
from iowbc.sim.objects import HANDS

BASE_LINEAR = slice(0, 3)
BASE_ANGULAR = slice(3, 6)


@dataclass(frozen=True)
class ModelIndex:
    """Indices into the arrays of a model and of its data. The robot comes first, then the object."""

    joints: slice
    """Robot's joint positions in qpos."""
    joint_speeds: slice
    """Robot's joint velocities in qvel."""
    object_position: slice | None
    """Object in qpos: a pose, or x, y and yaw of a crate."""
    object_velocity: slice | None
    """Object in qvel."""
    base: int
    torso: int
    feet: slice | Indices
    """Bodies of the feet, (2,)."""
    hands: slice | Indices
    """Bodies of the hands, (2,); without an object those of the wrists."""
    wrists: slice | Indices
    """Bodies of the wrists, (2,)."""
    object: int | None
    """Body of the object."""
    links: slice | Indices
    """Bodies of the robot's own description, in its order."""
    soles: slice | Indices
    """Sites of the soles, (2,)."""
    grips: slice | Indices
    """Sites of the grips, (2,)."""
    object_grips: Indices | None
    """Sites on the object to which the grips are connected, (2,)."""
    foot_geoms: Indices
    """Contact points of the feet."""
    palms: Indices | None
    """Geoms of the palms, (2,)."""
    momentum: Indices
    """Entries of the inertia matrix that couple the base's translation to the robot's other velocities, (3, speeds)."""
    momentum_speeds: slice
    """The velocities of `momentum` in qvel."""
    past_forces: slice
    """Entries of each hand in MuJoCo's history: two counters, then times and forces of a control period."""
    past_ground: slice
    """The same for the ground's force on each foot."""
    past_targets: slice
    """Entries of each motor, the first in MuJoCo's history: two counters, times, past targets."""
    object_geom: int | None
    """Geom with which the object touches palms."""

    @classmethod
    def of(cls, model: Any, robot: Robot) -> "ModelIndex":
        """Finds everything by name; checks that the joints are in the robot's order."""
        names = [model.joint(index).name for index in range(model.njnt)]
        count = len(robot.joints)
        if tuple(names[1 : count + 1]) != robot.joints:
            raise ValueError(f"{robot.mjcf}: joints compile to {names}, expected a free joint and then {robot.joints}")
        bodies = {model.body(index).name: index for index in range(model.nbody)}
        sites = {model.site(index).name: index for index in range(model.nsite)}
        geoms = {model.geom(index).name: index for index in range(model.ngeom)}
        feet = np.array([bodies[name] for name in robot.sole_bodies])
        points = [
            index for index in range(model.ngeom) if model.geom_bodyid[index] in feet and model.geom_conaffinity[index]
        ]
        thing = bodies.get("object")
        return cls(
            joints=slice(7, 7 + count),
            joint_speeds=slice(6, 6 + count),
            object_position=None if thing is None else slice(7 + count, model.nq),
            object_velocity=None if thing is None else slice(6 + count, model.nv),
            base=bodies[robot.base],
            torso=bodies[robot.torso],
            feet=as_slice(feet),
            hands=as_slice(np.array([bodies[name] for name in (robot.wrist_bodies if thing is None else HANDS)])),
            wrists=as_slice(np.array([bodies[name] for name in robot.wrist_bodies])),
            object=thing,
            links=as_slice(np.array([bodies[name] for name in robot.tree.bodies])),
            soles=as_slice(np.array([sites[name] for name in robot.soles])),
            grips=as_slice(np.array([sites[name] for name in robot.wrists])),
            object_grips=_pair(sites, "object_left_grip", "object_right_grip"),
            foot_geoms=np.array(points),
            palms=_pair(geoms, "left_palm", "right_palm"),
            momentum=np.array([model.M_rowadr[3 : 6 + count] + axis for axis in range(3)]),
            momentum_speeds=slice(3, 6 + count),
            past_forces=slice(0, 0) if thing is None else _past_forces(model, HANDS),
            past_ground=_past_forces(model, robot.sole_bodies),
            past_targets=slice(0, int(np.sum(2 + 2 * model.actuator_history[:, 0]))),
            object_geom=geoms.get("object"),
        )


def _past_forces(model: Any, names: tuple[str, str]) -> slice:
    first = model.sensor(names[0]).id
    start = int(model.sensor_historyadr[first])
    return slice(start, start + 2 * (2 + 4 * int(model.sensor_history[first, 0])))


def _pair(indices: dict[str, int], left: str, right: str) -> Indices | None:
    return np.array([indices[left], indices[right]]) if left in indices else None
