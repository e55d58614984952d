"""Desired motion of the object along its path, closed loop or by the clock, and commands of a robot that follows it."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, OFFSET, YAW_RATE
from iowbc.control.skill_command import SkillCommand
from iowbc.recipe.skill.skill import PathFollowing, Skill
from iowbc.recipe.task.commands import Commands
from iowbc.robot.rotations import turned, wrapped
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
    return ObjectMotion(
        velocity=turned(np.stack([speed, aside], axis=1), heading),
        yaw_rate=paths.curvature(now.path, covered) * speed,
        heading=heading,
        height=paths.height(now.path, covered + settings.ahead),
    )


class NominalCommand(SkillCommand):
    """Nominal commands of n robots, (n, 11), which know the path or follow."""

    def __init__(self, skill: Skill, commands: Commands, pushing: Mask) -> None:
        super().__init__(skill.robot, commands, pushing)
        self._pursuit = skill.pursuit

    def leading(self, wanted: ObjectMotion, now: GameState) -> Array:
        """Commands for the desired motion of the object; the base circles the object's centre as it turns: v_base =
        v_object - ω × (object - base), heading frame. The hands rise by the path's height plus the height error."""
        command = self.standing()
        rate = wanted.yaw_rate + self._pursuit.yaw * wrapped(wanted.heading - now.heading)
        command[:, :YAW_RATE] = turned(wanted.velocity, -now.heading)
        arm = turned(now.position[:, :2] - now.base[:, :2], -now.heading)
        command[:, 0] += rate * arm[:, 1]
        command[:, 1] -= rate * arm[:, 0]
        command[:, YAW_RATE] = rate
        height = command[:, HEIGHT] + (2.0 * wanted.height - now.position[:, 2]) * ~self._pushing
        command[:, HEIGHT] = height.clip(*self._commands.height)  # the legs as far as possible, then the arms
        command[:, OFFSET][:, 2::3] += (height - command[:, HEIGHT])[:, None]
        return command
