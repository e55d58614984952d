"""Nominal commands of a robot that knows the path."""

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, OFFSET, YAW_RATE
from iowbc.control.skill_command import SkillCommand
from iowbc.recipe.skill.skill import Skill
from iowbc.recipe.task.commands import Commands
from iowbc.robot.rotations import wrapped
from iowbc.skill.object_motion import ObjectMotion
from iowbc.skill.situation import GameState, turned


class NominalCommand(SkillCommand):
    """Nominal commands of n robots, (n, 11), which know the path or follow."""

    def __init__(self, skill: Skill, commands: Commands, pushing: Mask) -> None:
        """`pushing`: games with a crate, (n,)."""
        super().__init__(skill.robot, commands, pushing)
        self._pursuit = skill.pursuit

    def leading(self, wanted: ObjectMotion, now: GameState) -> Array:
        """Commands for the desired motion of the object; the base circles the object's centre as it turns.

        v_base = v_object - ω × (object - base), in the heading frame. The hands rise by the path's height plus the
        object's height error.
        """
        command = self.standing()
        rate = wanted.yaw_rate + self._pursuit.yaw * wrapped(wanted.heading - now.heading)
        command[:, :YAW_RATE] = turned(wanted.velocity, -now.heading)
        arm = turned(now.position[:, :2] - now.base[:, :2], -now.heading)
        command[:, 0] += rate * arm[:, 1]
        command[:, 1] -= rate * arm[:, 0]
        command[:, YAW_RATE] = rate
        height, (low, high) = 2.0 * wanted.height - now.position[:, 2], self._commands.height
        legs = (command[:, HEIGHT] + height * ~self._pushing).clip(low, high)  # as far as possible, then the arms
        rest = command[:, HEIGHT] + height * ~self._pushing - legs
        command[:, HEIGHT] = legs
        command[:, OFFSET][:, 2::3] += rest[:, None]
        return command
