"""Height feedback: motors yield under robot and load, and the pelvis sags below its command. Both legs stretch by the
integral of the error."""

from dataclasses import dataclass
from typing import Self

from iowbc.arrays import Array, Constants, namespace
from iowbc.control.command import HEIGHT
from iowbc.control.odometry import LegOdometry
from iowbc.control.sensors import Measured
from iowbc.recipe.task.joint_references import HeightFeedback
from iowbc.robot.description import Robot


@dataclass(frozen=True)
class LegStretch(Constants):
    """The feedback of a robot. Holds constants only."""

    settings: HeightFeedback
    odometry: LegOdometry

    @classmethod
    def of(cls, robot: Robot, settings: HeightFeedback | None) -> Self | None:
        """The feedback of a robot, or none where it is switched off."""
        return None if settings is None else cls(settings, LegOdometry.of(robot))

    def __call__(self, stretch: Array, measured: Measured, command: Array, period: float) -> Array:
        """Stretch of both legs a control period [s] later, (n, 1) [m]; `command` C (n, 11)."""
        left, right = self.odometry.height(measured).T
        lower = (command[:, HEIGHT] - namespace(left).maximum(left, right))[:, None]
        furthest = self.settings.furthest
        return (stretch + self.settings.integral * period * lower).clip(-furthest, furthest)
