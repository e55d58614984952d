"""Torso feedback: the waist's motors yield under a load, and the torso leans further than commanded. Both hips turn the
pelvis back by the integral of the error."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from iowbc.arrays import Array, Constants, Indices, as_slice
from iowbc.control.command import PITCH
from iowbc.control.legs import leg_joints
from iowbc.control.sensors import Measured
from iowbc.control.stride import HIP_PITCH
from iowbc.recipe.task.joint_references import TorsoFeedback
from iowbc.robot.description import Robot


@dataclass(frozen=True)
class HipFeedback(Constants):
    """The feedback of a robot. Holds constants only."""

    settings: TorsoFeedback
    waist: slice | Indices
    """Places of the waist's pitch joints among all joints."""
    hips: Array
    """One for each support joint that is a hip pitch, else zero."""
    lower: Array
    upper: Array
    """Ranges of the support joints [rad]."""

    @classmethod
    def of(cls, robot: Robot, settings: TorsoFeedback | None) -> Self | None:
        """The feedback of a robot, or none where it is switched off."""
        if settings is None:
            return None
        hips = np.zeros(len(robot.support))
        hips[[leg[HIP_PITCH] for leg in leg_joints(robot)]] = 1.0
        lower, upper = robot.lower[robot.support], robot.upper[robot.support]
        return cls(settings, as_slice(robot.support[robot.waist_pitch]), hips, lower, upper)

    def __call__(self, turn: Array, measured: Measured, command: Array, period: float) -> Array:
        """Turn of both hips a control period [s] later, (n, 1) [rad]; `command` C (n, 11)."""
        torso = measured.pitch + measured.joint_position[:, self.waist].sum(1)
        further = (torso - command[:, PITCH])[:, None]
        return (turn + self.settings.integral * period * further).clip(-self.settings.least, self.settings.furthest)

    def turned(self, support: Array, turn: Array) -> Array:
        """θ_S_ref with the turn of the hips, (n, support joints) [rad]."""
        return (support + turn * self.hips).clip(self.lower, self.upper)
