"""Command of the skill layer: an admittance to the hand forces, and a nominal command plus the skill's action."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, OFFSET, PITCH, VELOCITY, YAW_RATE, nominal_command
from iowbc.recipe.skill.skill import RobotAgent
from iowbc.recipe.task.commands import Commands


class SkillCommand:
    """Commands of n robots, (n, 11)."""

    def __init__(self, robot: RobotAgent, commands: Commands, pushing: Mask) -> None:
        """`pushing`: robots with a crate in front of them, (n,)."""
        self._robot, self._pushing = robot, pushing
        self._commands = commands
        self._still = np.tile(nominal_command(commands), (len(pushing), 1))
        self._still[pushing, PITCH] = robot.push_pitch
        if robot.push_height is not None:
            self._still[pushing, HEIGHT] = robot.push_height
        self._scale = np.array([*robot.velocity, robot.yaw_rate, robot.height, robot.pitch, *[robot.offset] * 6])
        axes = ("velocity_x", "velocity_y", "yaw_rate")
        level, push = (np.array([getattr(own, name) for name in axes]).T for own in (commands, commands.pushing))
        ranges = np.where(pushing[:, None, None], push, level)
        self._low, self._high = ranges[:, 0], ranges[:, 1]

    def standing(self) -> Array:
        return self._still.copy()

    def following(self, force: Array, object_yaw: Array) -> Array:
        """Commands of an admittance: `force` (n, 3) on both hands [N] and yaw of the object (n,) [rad], heading frame.
        In a push it moves forward until the hands meet a force."""
        command, robot = self.standing(), self._robot
        felt = force[:, :YAW_RATE].copy()
        felt[:, 0] += self._pushing * robot.push_force
        beyond = np.sign(felt) * (np.abs(felt) - robot.deadband).clip(0.0, None)
        command[:, :YAW_RATE] = beyond * robot.admittance
        command[:, YAW_RATE] = robot.alignment * object_yaw
        return command

    def with_action(self, nominal: Array, action: Array) -> Array:
        """Nominal command and scaled action (n, 11) in [-1, 1], within the ranges of training."""
        command: Array = nominal + self._scale * action
        command[:, VELOCITY] = command[:, VELOCITY].clip(self._low, self._high)
        command[:, HEIGHT] = command[:, HEIGHT].clip(*self._commands.height)
        command[:, PITCH] = command[:, PITCH].clip(*self._commands.pitch)
        wrists = command[:, OFFSET].reshape(-1, 2, 3)
        shared = wrists.mean(axis=1, keepdims=True)
        single, common = np.array(self._commands.single_offset), np.array(self._commands.common_offset)
        wrists = shared.clip(-common, common) + (wrists - shared).clip(-single, single)
        command[:, OFFSET] = wrists.reshape(-1, 6)
        return command

    def action_of(self, command: Array, nominal: Array) -> Array:
        """The action that moves a nominal command to another, (n, 11) in [-1, 1]."""
        return ((command - nominal) / self._scale).clip(-1.0, 1.0)
