"""Desired motion of the object along its path, closed loop or by the clock, and how robots and humans follow it:
nominal commands; intentions by script, by action or by a person's hand."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, OFFSET, YAW_RATE
from iowbc.control.skill_command import SkillCommand
from iowbc.recipe.skill.skill import PathFollowing, Skill
from iowbc.recipe.task.commands import Commands
from iowbc.robot.rotations import turned, wrapped
from iowbc.skill.situation import GameState, Paths


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


class Human:
    """Intentions of n humans: velocity of the handle (start frame), yaw rate, and height of the handle."""

    def __init__(self, skill: Skill, n: int, period: float) -> None:
        """`period`: control period [s]."""
        self._settings, self._pursuit, self._period = skill.human, skill.pursuit, period
        self._velocity, self._height = np.zeros((n, 4)), np.zeros((n, 2))
        """Velocity and yaw rate; height integrated from the velocity, and height offset."""
        self._offset = np.zeros(n)

    def start(self, which: Array) -> None:
        """Resets some humans, (k,)."""
        self._velocity[which], self._height[which], self._offset[which] = 0.0, 0.0, 0.0

    def of_action(self, action: Array, now: GameState) -> Array:
        """Intentions that actions add to the script's, (n, 5): velocity [m/s], yaw rate [rad/s], height offset [m].
        `action` (n, 5) in [-1, 1]: handle's velocity in the frame of the object's yaw, height offset, yaw rate."""
        s = self._settings
        scaled = action * np.array([s.velocity, s.velocity, s.vertical_velocity, s.height, s.yaw_rate])
        return np.concatenate([turned(scaled[:, :3], now.yaw), scaled[:, 4:], scaled[:, 3:4]], axis=1)

    def of_script(self, wanted: ObjectMotion, now: GameState) -> Array:
        """Intentions (n, 5) for the desired motion of the object; the handle circles its centre as it turns."""
        rate = wanted.yaw_rate + self._pursuit.yaw * wrapped(wanted.heading - now.yaw)
        arm = now.handle - now.position
        rise = (wanted.height - now.position[:, 2]) * self._pursuit.vertical
        limit = self._settings.vertical_velocity
        columns = [wanted.velocity[:, 0] - rate * arm[:, 1], wanted.velocity[:, 1] + rate * arm[:, 0]]
        return np.stack([*columns, rise.clip(-limit, limit), rate, np.zeros(len(rate))], axis=1)

    def intend(self, intentions: Array) -> None:
        """Sets intentions (n, 5) until the next decision."""
        self._velocity, self._offset = intentions[:, :4], intentions[:, 4]

    def reach(self, which: Mask, away: Array, now: GameState) -> None:
        """Moves the springs of some humans, (n,), towards hands at the offset `away` (n, 3) [m] (start frame), at most
        as fast as the human agent. The object's yaw is left to the robot."""
        s = self._settings
        velocity, fastest = away / s.hand_time, self._pursuit.speed + s.velocity
        velocity[:, :2] *= fastest / np.linalg.norm(velocity[:, :2], axis=1).clip(fastest)[:, None]
        velocity[:, 2] = velocity[:, 2].clip(-s.vertical_velocity, s.vertical_velocity)
        self._velocity[which] = np.column_stack([velocity, now.yaw_rate])[which]
        self._offset[which] = 0.0

    def advance(self) -> Array:
        """Input of the simulated partner for the next control step, (n, 4): see `Partner.steered`."""
        step = self._settings.vertical_velocity * self._period
        self._height[:, 0] += self._velocity[:, 2] * self._period
        self._height[:, 1] += (self._offset - self._height[:, 1]).clip(-step, step)
        return np.stack([*self._velocity[:, [0, 1, 3]].T, self._height.sum(axis=1)], axis=1)
