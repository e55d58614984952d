"""Fractions of the commanded path that robot and object cover, and their lateral distance."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import YAW_RATE
from iowbc.robot.rotations import turned

SHORTEST_WAY = 0.1
"""Minimum commanded distance for a transport metric [m]."""


def commanded_path(given: Array, heading: float, dt: float) -> tuple[Array, float]:
    """Directions of the commanded motion in the world frame, (T, 2), zero in standing, and path length [m].

    given: commands (T, 11); heading: of the robot at the start [rad].
    """
    yaw = heading + dt * np.cumsum(given[:, YAW_RATE])
    velocity, speed = turned(given[:, :2], yaw), np.hypot(given[:, 0], given[:, 1])
    directions = np.divide(velocity, speed[:, None], out=np.zeros_like(velocity), where=speed[:, None] > 0)
    return directions, float(speed.sum() * dt)


def covered(position: Array, directions: Array, length: float) -> float:
    """Fraction of a commanded path that a body covers; NaN for a path shorter than `SHORTEST_WAY`.

    position: (T, 2 or more) [m]; directions: (T or more, 2) and length [m] of `commanded_path`. Covered distance is the
    body's motion along the direction commanded at the time; swaying cancels and sideways motion does not count.
    """
    if length < SHORTEST_WAY:
        return np.nan
    steps = np.diff(position[:, :2], axis=0)
    return float(np.sum(steps * directions[1 : len(position)]) / length)


def beside(robot: Array, heading: Array, body: Array, moving: Mask) -> float:
    """Largest lateral distance of a body from the robot while stepping is commanded [m]; NaN if it never is.

    robot, body: (T, 2 or more) [m]; heading: (T,) [rad]; moving: (T,).
    """
    if not moving.any():
        return np.nan
    away = body[:, :2] - robot[:, :2]
    aside = np.cos(heading) * away[:, 1] - np.sin(heading) * away[:, 0]
    return float(np.max(np.abs(aside[moving])))
