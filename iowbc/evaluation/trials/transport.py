"""Parts of the commanded way that robot and object cover, and their distance to the side."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import YAW_RATE

SHORTEST_WAY = 0.1
"""Least commanded way with a transport [m]."""


def commanded_path(given: Array, heading: float, dt: float) -> tuple[Array, float]:
    """Directions of the commanded motion in the world, (T, 2), zero while it stands, and its length [m].

    given: commands (T, 11); heading: of the robot at the start [rad].
    """
    yaw = heading + dt * np.cumsum(given[:, YAW_RATE])
    speed = np.hypot(given[:, 0], given[:, 1])
    turned = np.stack(
        [np.cos(yaw) * given[:, 0] - np.sin(yaw) * given[:, 1], np.sin(yaw) * given[:, 0] + np.cos(yaw) * given[:, 1]],
        axis=1,
    )
    directions = np.divide(turned, speed[:, None], out=np.zeros_like(turned), where=speed[:, None] > 0)
    return directions, float(speed.sum() * dt)


def covered(position: Array, directions: Array, length: float) -> float:
    """The part of a commanded way that a body covers; NaN where none is commanded.

    position: (T, 2 or more) [m]; directions: (T or more, 2) and length [m] of `commanded_path`. What is covered is the
    body's motion along the direction commanded at the time: swaying cancels, running away sideways counts nothing.
    """
    if length < SHORTEST_WAY:
        return np.nan
    steps = np.diff(position[:, :2], axis=0)
    return float(np.sum(steps * directions[1 : len(position)]) / length)


def beside(robot: Array, heading: Array, body: Array, moving: Mask) -> float:
    """The largest distance of a body to the side of the robot while steps are asked for [m]; NaN where none are.

    robot, body: (T, 2 or more) [m]; heading: (T,) [rad]; moving: (T,).
    """
    if not moving.any():
        return np.nan
    away = body[:, :2] - robot[:, :2]
    aside = np.cos(heading) * away[:, 1] - np.sin(heading) * away[:, 0]
    return float(np.max(np.abs(aside[moving])))
