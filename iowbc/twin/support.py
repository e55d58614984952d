"""What holds a robot until it stands by itself: an elastic band, or a fixture that holds robot and object still."""

from typing import Literal

import numpy as np

from iowbc.arrays import Array

STIFFNESS, DAMPING = 2000.0, 400.0
"""Of the band [N/m], [N·s/m]; it stretches by 0.16 m under a G1."""
LIFT = 0.2
"""How far above the standing robot the unstretched band ends [m]: its feet hang 4 cm above the ground."""
LOWERED = 0.04
"""The same once the robot is to stand: the band bears a quarter of its weight, and keeps it upright."""
LOWERING = 2.0
"""Time to lower the robot, and to slacken the band [s]."""


class Support:
    """Holds at first, is lowered once the joints have their full gains, and lets go `release` seconds after that."""

    def __init__(self, kind: Literal["band", "fixture", "none"], release: float) -> None:
        self.kind, self._release = kind, release
        self._time = 0.0
        self.just_released = False

    def advance(self, period: float, stiff: bool) -> None:
        """A period [s]; `stiff`: the joints have their full gains. Once released, it stays so."""
        before = self._time
        self._time += period if stiff or before >= self._release else 0.0
        self.just_released = self.kind == "fixture" and before < self._release <= self._time

    @property
    def rigid(self) -> bool:
        """Whether nothing moves."""
        return self.kind == "fixture" and self._time < self._release

    def force(self, away: Array, velocity: Array) -> Array:
        """Force on the torso, world frame, (3,) [N]; `away` from where it began (3,) [m], `velocity` (3,) [m/s]."""
        if self.kind != "band":
            return np.zeros(3)
        held = 1.0 - np.clip((self._time - self._release) / LOWERING, 0.0, 1.0)
        lowered = np.clip(self._time / LOWERING, 0.0, 1.0)
        end = np.array([0.0, 0.0, LIFT + lowered * (LOWERED - LIFT)])
        force: Array = held * (STIFFNESS * (end - away) - DAMPING * velocity)
        return force
