"""The arms and the waist of a robot as the page's inverse kinematics takes them."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from iowbc.control.arms import arm_chains
from iowbc.robot import rotations
from iowbc.robot.description import Robot
from iowbc.robot.mjcf import Body


def kinematics(robot: Robot) -> dict[str, Any]:
    """Chains of bodies outward from the torso and from the base, grips [m], and the waist's places in the support."""
    chains, waist = arm_chains(robot)
    return {
        "chains": [_chain(robot, chain) for chain in chains],
        "waist": _chain(robot, waist),
        "grips": robot.grip_offset.tolist(),
        "waist_joints": robot.waist.tolist(),
        "waist_pitch": robot.waist_pitch.tolist(),
    }


def _chain(robot: Robot, bodies: Sequence[Body]) -> list[dict[str, Any]]:
    """Of each body place in the one before [m], axis, and mass [kg] and first moment [kg·m] of what is fixed to it."""
    links = []
    for body in bodies:
        mass, moment = robot.tree.burden(body.name) if body.hinge else (0.0, np.zeros(3))
        links.append(
            {
                "position": body.position.tolist(),
                "rotation": np.ravel(rotations.matrix(body.quaternion)).tolist(),
                "axis": None if body.hinge is None else body.hinge.axis.tolist(),
                "mass": mass,
                "moment": moment.tolist(),
            }
        )
    return links
