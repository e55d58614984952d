"""The robot's nominal command, and how the action departs from it."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, OFFSET, PITCH, VELOCITY, YAW_RATE
from iowbc.recipe.skill.skill import Skill
from iowbc.recipe.task.commands import Commands
from iowbc.skill.pursuit import Wanted
from iowbc.skill.situation import Situation, turned, wrapped
from iowbc.task.commands.drawing import nominal_command


class NominalCommand:
    """Commands of n robots, (n, 11)."""

    def __init__(self, skill: Skill, commands: Commands, pushing: Mask) -> None:
        """`pushing`: games with a crate, (n,)."""
        self._skill, self._robot, self._pushing = skill, skill.robot, pushing
        self._commands = commands
        self._still = np.tile(nominal_command(commands), (len(pushing), 1))
        self._still[pushing, PITCH] = self._robot.push_pitch
        robot = self._robot
        self._scale = np.array([*robot.velocity, robot.yaw_rate, robot.height, robot.pitch, *[robot.offset] * 6])
        ahead = np.where(pushing[:, None, None], _ranges(commands.pushing), _ranges(commands))
        self._low, self._high = ahead[:, 0], ahead[:, 1]

    def standing(self) -> Array:
        """Commands to stand."""
        return self._still.copy()

    def leading(self, wanted: Wanted, now: Situation) -> Array:
        """Commands that move the object as wanted: the base goes round the object's centre as it turns.

        v_base = v_object - ω × (object - base), in the heading frame. The hands rise by the height of the path, and
        once more by what the object lacks of it.
        """
        command = self.standing()
        rate = wanted.yaw_rate + self._skill.pursuit.yaw * wrapped(wanted.heading - now.heading)
        command[:, :YAW_RATE] = turned(wanted.velocity, -now.heading)
        arm = turned(now.position[:, :2] - now.base[:, :2], -now.heading)
        command[:, 0] += rate * arm[:, 1]
        command[:, 1] -= rate * arm[:, 0]
        command[:, YAW_RATE] = rate
        self._raise(command, 2.0 * wanted.height - now.position[:, 2])
        return command

    def following(self, force: Array, object_yaw: Array) -> Array:
        """Commands of an admittance: `force` (n, 3) on both hands [N] and yaw of the object (n,) [rad], heading frame.
        In a push, forward until the hands meet a force."""
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
        low, high = self._commands.height
        command[:, HEIGHT] = command[:, HEIGHT].clip(low, high)
        command[:, PITCH] = command[:, PITCH].clip(*self._commands.pitch)
        wrists = command[:, OFFSET].reshape(-1, 2, 3)
        shared = wrists.mean(axis=1, keepdims=True)
        single, common = np.array(self._commands.single_offset), np.array(self._commands.common_offset)
        wrists = shared.clip(-common, common) + (wrists - shared).clip(-single, single)
        command[:, OFFSET] = wrists.reshape(-1, 6)
        return command

    def _raise(self, command: Array, height: Array) -> None:
        """Raises the hands by heights (n,) [m]: with the legs as far as they go, then with the arms."""
        low, high = self._commands.height
        legs = (command[:, HEIGHT] + height * ~self._pushing).clip(low, high)
        rest = command[:, HEIGHT] + height * ~self._pushing - legs
        command[:, HEIGHT] = legs
        command[:, OFFSET][:, 2::3] += rest[:, None]


def _ranges(ranges: object) -> Array:
    """Lower and upper ends of the velocities, (2, 3)."""
    return np.array([getattr(ranges, name) for name in ("velocity_x", "velocity_y", "yaw_rate")]).T
