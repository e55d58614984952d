"""Desired motion of the object along its path, closed loop or by the clock."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.skill.skill import PathFollowing
from iowbc.skill.path import Paths
from iowbc.skill.situation import GameState


@dataclass(frozen=True)
class ObjectMotion:
    """Desired motion of the object, start frame."""

    velocity: Array
    """Horizontal velocity, (n, 2) [m/s]."""
    yaw_rate: Array
    """Yaw rate of the path at that speed, (n,) [rad/s], without yaw correction."""
    heading: Array
    """Heading of the path, (n,) [rad]."""
    height: Array
    """Height of the path a little ahead, (n,) [m]."""


def pursue(settings: PathFollowing, paths: Paths, now: GameState) -> ObjectMotion:
    """v = v_0 min(1, remaining length / slowing) t - k e n: tangent t, normal n, distance e from the path."""
    speed = settings.speed * np.minimum(1.0, now.left / settings.slowing)
    return _along(settings, paths, now, now.covered, speed, -settings.lateral * now.lateral)


def open_loop_motion(
    settings: PathFollowing, paths: Paths, now: GameState, seconds: Array, pace: Array | float
) -> ObjectMotion:
    """Open-loop motion along the path at `pace` (n,) times the nominal speed; `seconds` (n,) since the start."""
    covered = settings.speed * pace * seconds
    speed = settings.speed * pace * (covered < paths.length[now.path])
    return _along(settings, paths, now, covered, speed, np.zeros(len(seconds)))


def _along(
    settings: PathFollowing, paths: Paths, now: GameState, covered: Array, speed: Array, aside: Array
) -> ObjectMotion:
    heading = paths.heading(now.path, covered)
    cosine, sine = np.cos(heading), np.sin(heading)
    return ObjectMotion(
        velocity=np.stack([speed * cosine - aside * sine, speed * sine + aside * cosine], axis=1),
        yaw_rate=paths.curvature(now.path, covered) * speed,
        heading=heading,
        height=paths.height(now.path, covered + settings.ahead),
    )
