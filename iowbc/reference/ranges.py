"""Check of the sampling ranges against the robot."""

from collections.abc import Iterator

import numpy as np

from iowbc.errors import nearest
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.robot.description import Robot

LOWEST, HIGHEST = 0.3, 1.1
"""Range of heights that may be sampled, relative to the base height with straight legs: catches units and typos."""
STEEPEST = np.pi / 2
"""Largest torso pitch [rad]."""


def wrong_ranges(robot: Robot, recipe: ReferenceGenerator) -> Iterator[tuple[str, str]]:
    """Dotted recipe path and error of each range that the robot does not have or cannot reach."""
    sampling = recipe.sampling
    arms = {robot.joints[index]: index for index in robot.interaction}
    for name, asked in sampling.joint_ranges.items():
        path = f"rg.sampling.joint_ranges.{name}"
        if name not in arms:
            reason = "is no arm joint" if name in robot.joints else "is no joint"
            yield path, f"{reason} of {robot.name}; valid: {', '.join(arms)}{nearest(name, arms)}"
            continue
        lower, upper = float(robot.lower[arms[name]]), float(robot.upper[arms[name]])
        if asked.low < lower or asked.high > upper:
            yield path, f"{asked.low:g} to {asked.high:g}: the joint's limits are {lower:.4g} to {upper:.4g} rad"
    straight = straight_height(robot)
    height, lower, upper = sampling.height, LOWEST * straight, HIGHEST * straight
    if height.low < lower or height.high > upper:
        yield (
            "rg.sampling.height",
            f"{height.low:g} to {height.high:g}: {robot.name} is {straight:.3g} m high at its base with straight legs; "
            f"valid: {lower:.2f} to {upper:.2f} m",
        )
    pitch = sampling.pitch
    if pitch.low < -STEEPEST or pitch.high > STEEPEST:
        yield "rg.sampling.pitch", f"{pitch.low:g} to {pitch.high:g}: valid is within ±{STEEPEST:.4f} rad"


def straight_height(robot: Robot) -> float:
    """Height of the base above the soles with all joints at zero, or as near to it as they go [m]."""
    straight = dict(zip(robot.joints, np.clip(0.0, robot.lower, robot.upper).tolist(), strict=True))
    return -float(robot.tree.forward(straight, robot.base, robot.soles[0])[0][2])
