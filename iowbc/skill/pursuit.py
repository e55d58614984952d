"""Motion along a path: what scripted agents that know it want the object to do."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.skill.skill import Pursuit
from iowbc.skill.path import Paths
from iowbc.skill.situation import Situation


@dataclass(frozen=True)
class Wanted:
    """Motion of the object, frame of the start."""

    velocity: Array
    """Horizontal, (n, 2) [m/s]."""
    yaw_rate: Array
    """Of the path at that speed, (n,) [rad/s]; without a correction of the yaw."""
    heading: Array
    """Of the path, (n,) [rad]."""
    height: Array
    """Of the path a little ahead, (n,) [m]."""


def pursue(settings: Pursuit, paths: Paths, now: Situation) -> Wanted:
    """v = v_0 min(1, way left / slowing) t - k e n, with the tangent t, the distance e from the path, its normal n."""
    speed = settings.speed * np.minimum(1.0, now.left / settings.slowing)
    return _along(settings, paths, now, now.covered, speed, -settings.lateral * now.lateral)


def by_the_clock(settings: Pursuit, paths: Paths, now: Situation, seconds: Array, pace: Array | float = 1.0) -> Wanted:
    """The path at a pace (n,) times the nominal speed, whatever the object does; `seconds` (n,) since the start."""
    covered = settings.speed * pace * seconds
    speed = settings.speed * pace * (covered < paths.length[now.path])
    return _along(settings, paths, now, covered, speed, np.zeros(len(seconds)))


def _along(settings: Pursuit, paths: Paths, now: Situation, covered: Array, speed: Array, aside: Array) -> Wanted:
    heading = paths.heading(now.path, covered)
    cosine, sine = np.cos(heading), np.sin(heading)
    return Wanted(
        velocity=np.stack([speed * cosine - aside * sine, speed * sine + aside * cosine], axis=1),
        yaw_rate=paths.curvature(now.path, covered) * speed,
        heading=heading,
        height=paths.height(now.path, covered + settings.ahead),
    )
