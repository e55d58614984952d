"""The robot as a pinocchio model, read from the same MJCF that MuJoCo simulates."""

from typing import Any

import numpy as np
import pinocchio

from iowbc.arrays import Array
from iowbc.robot.description import Robot

BASE_RANGE = 10.0
"""Bound on the floating base's position [m]; pinocchio's reader leaves ±1.01, which optimisers take for a limit."""
ROOT = "root_joint"
"""Name that crocoddyl's floating-base actuation looks for."""


def build_model(robot: Robot) -> Any:
    """A `pinocchio.Model` in MuJoCo's joint order (nq 7 + joints, nv 6 + joints), with armature and limits."""
    model = pinocchio.buildModelFromMJCF(str(robot.mjcf))
    names = tuple(model.names)[2:]
    if model.names[1] != ROOT or names != robot.joints:
        raise ValueError(
            f"{robot.mjcf}: pinocchio reads joints {model.names[1]}, {names}; the free joint must be named {ROOT!r} "
            f"and the others be {robot.joints}"
        )
    model.armature = np.concatenate([np.zeros(6), robot.armature])
    model.rotorInertia = np.zeros(model.nv)
    effort, velocity = (np.concatenate([np.full(6, np.inf), limit]) for limit in (robot.effort, robot.velocity_limit))
    model.lowerEffortLimit, model.upperEffortLimit = -effort, effort
    model.lowerVelocityLimit, model.upperVelocityLimit = -velocity, velocity
    model.lowerPositionLimit = np.concatenate([np.full(3, -BASE_RANGE), np.full(4, -1.01), robot.lower])
    model.upperPositionLimit = np.concatenate([np.full(3, BASE_RANGE), np.full(4, 1.01), robot.upper])
    return model


def configuration(position: Array, quaternion: Array, joints: Array) -> Array:
    """pinocchio's q (7 + joints,) from base position (3,), quaternion wxyz (4,) and joints; pinocchio writes xyzw."""
    return np.concatenate([position, np.roll(quaternion, -1), joints])
