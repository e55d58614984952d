"""Geometry of the legs with all joints at zero."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Constants, namespace
from iowbc.robot.description import Robot
from iowbc.robot.mjcf import Hinge

AXES = ("y", "x", "z", "y", "y", "x")
"""Axes of a leg's joints from the hip outward: hip pitch, roll, yaw, knee, ankle pitch, roll."""

Pair = tuple[Array, Array]
"""Coordinates in the sagittal plane, forward and up."""


@dataclass(frozen=True)
class Legs(Constants):
    """Geometry of both legs, left and right, with all joints at zero: [m]; arrays of shape (2,)."""

    side: Array
    """The sole's distance to the left of the base."""
    hip: Pair
    """The hip pitch axis ahead of and above the base."""
    thigh: Pair
    """The knee from the hip pitch axis."""
    shank: Pair
    """The ankle pitch axis from the knee."""
    sole: Pair
    """The sole's centre from the ankle pitch axis."""
    roll: Pair
    yaw: Pair
    """The hip roll axis and the hip yaw axis from the hip pitch axis."""
    tilt: Pair
    """Direction of the hip yaw axis."""
    ankle_roll_z: Array
    """The ankle roll axis above the sole's centre."""


def leg_joints(robot: Robot) -> list[list[int]]:
    """Places of each leg's joints, as in `AXES`, among the support joints. Raises ValueError for other joints."""
    names = [robot.joints[index] for index in robot.support]
    legs = []
    for sole in robot.sole_bodies:
        hinges = robot.tree.hinges_between(sole, robot.base)
        found = tuple(map(_axis, hinges))
        if found != AXES:
            raise ValueError(
                f"{robot.folder}: the leg of {sole} turns about {', '.join(found)}; the gait prior is made for "
                f"{', '.join(AXES)}: set task.references.gait.enabled to false"
            )
        legs.append([names.index(hinge.name) for hinge in hinges])
    return legs


def leg_geometry(robot: Robot) -> Legs:
    legs = [_vectors(robot, *pair) for pair in zip(robot.sole_bodies, robot.soles, strict=True)]
    both = {name: np.array([leg[name] for leg in legs]) for name in legs[0]}
    side, ankle_roll = both.pop("side")[:, 1], both.pop("ankle_roll")[:, 2]
    pairs = {name: (vectors[:, 0], vectors[:, 2]) for name, vectors in both.items()}
    return Legs(side=side, ankle_roll_z=ankle_roll, **pairs)


def _vectors(robot: Robot, sole_body: str, sole: str) -> dict[str, Array]:
    """Vectors of one leg, by the names of `Legs`, (3,) each; `side`: the sole's centre from the base."""
    tree, zero = robot.tree, dict.fromkeys(robot.joints, 0.0)
    chain = [body for body in tree.chain(sole_body, robot.base) if body.hinge is not None]
    poses = [tree.pose(zero, robot.base, body.name) for body in chain]
    tilt = poses[2][1] @ tree.hinges_between(sole_body, robot.base)[2].axis
    end = tree.forward(zero, robot.base, sole)[0]
    hip, roll, yaw, knee, ankle, ankle_roll = (position for position, _ in poses)
    vectors = {"side": end, "hip": hip, "thigh": knee - hip, "shank": ankle - knee, "sole": end - ankle}
    return vectors | {"roll": roll - hip, "yaw": yaw - hip, "tilt": tilt, "ankle_roll": ankle_roll - end}


def _axis(hinge: Hinge) -> str:
    """The coordinate axis about which a hinge turns, or its direction where it is none."""
    found = [name for name, unit in zip("xyz", np.eye(3), strict=True) if np.array_equal(hinge.axis, unit)]
    return found[0] if found else f"({', '.join(f'{value:g}' for value in hinge.axis)})"


def direction(angle: Array) -> tuple[Array, Array]:
    xp = namespace(angle)
    return xp.cos(angle), xp.sin(angle)


def pitched(direction: tuple[Array, Array], x: Array, z: Array) -> Pair:
    """Vectors of the sagittal plane turned as a positive pitch turns them: what points up leans forward."""
    cosine, sine = direction
    return cosine * x + sine * z, cosine * z - sine * x
