"""Support of a robot until it stands: an elastic band, or a fixture that holds robot and object still."""

from typing import Literal

import numpy as np

from iowbc.arrays import Array

STIFFNESS, DAMPING = 2000.0, 200.0
"""Stiffness and damping along the band [N/m, N·s/m]; it stretches by 0.16 m under a G1."""
SWAY = 30.0
"""Damping across the taut band [N·s/m]; air and bearings damp a hanging robot."""
HOOK = np.array([0.0, 0.0, 0.35])
"""Attachment of the band, torso frame [m]: between the shoulders."""
LENGTH = 1.0
"""Length of the band from that point of a standing robot to its upper end [m]."""
HANGING, LOWERED, SLACK = 0.2, 0.12, -0.2
"""Stretch of the band with the robot at the height of standing [m]: at first its feet hang 4 cm above the ground;
lowered, the band bears three quarters of its weight and keeps it upright."""
LOWERING, SLACKENING = 2.0, 3.0
"""Time to lower the robot, and to slacken the band before it is unhooked [s]."""


class Support:
    """Holds the robot, lowers it once the joints have their full gains, and lets go `release` seconds after that."""

    def __init__(self, kind: Literal["band", "fixture", "none"], release: float) -> None:
        self.kind, self._release = kind, release
        self._time = 0.0
        self.just_released = False
        self._was_rigid = self.rigid

    def advance(self, period: float, stiff: bool) -> None:
        """Advances by a period [s]; `stiff`: the joints have their full gains. A release is final."""
        self._time += period if stiff or self._time >= self._release else 0.0
        self.just_released = self._was_rigid and not self.rigid
        self._was_rigid = self.rigid

    def let_go(self) -> None:
        """Releases the robot now, whatever its gains; a band still lowers it and slackens first."""
        self._release = min(self._release, self._time)

    @property
    def waits(self) -> bool:
        return self.kind != "none" and self._time < self._release

    @property
    def rigid(self) -> bool:
        return self.kind == "fixture" and self.waits

    def force(self, away: Array, velocity: Array) -> Array:
        """Force on the hook, world frame, (3,) [N]; `away`: its displacement (3,) [m]; `velocity` (3,) [m/s]."""
        release = max(LOWERING, self._release)
        times = (0.0, LOWERING, release, release + SLACKENING)
        if self.kind != "band" or self._time > times[-1]:
            return np.zeros(3)
        stretched = np.interp(self._time, times, (HANGING, LOWERED, LOWERED, SLACK))
        along = np.array([0.0, 0.0, LENGTH]) - away
        distance = float(np.linalg.norm(along))
        along = along / distance
        speed = float(along @ velocity)
        tension = STIFFNESS * (distance - LENGTH + stretched) - DAMPING * speed
        if tension <= 0.0:
            return np.zeros(3)
        return tension * along - SWAY * (velocity - speed * along)
