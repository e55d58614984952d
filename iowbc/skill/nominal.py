"""The robot's nominal command."""

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, OFFSET, YAW_RATE
from iowbc.control.skill_command import SkillCommand
from iowbc.recipe.skill.skill import Skill
from iowbc.recipe.task.commands import Commands
from iowbc.robot.rotations import wrapped
from iowbc.skill.pursuit import Wanted
from iowbc.skill.situation import Situation, turned


class NominalCommand(SkillCommand):
    """Nominal commands of n games, (n, 11), of robots that know the path or follow."""

    def __init__(self, skill: Skill, commands: Commands, pushing: Mask) -> None:
        """`pushing`: games with a crate, (n,)."""
        super().__init__(skill.robot, commands, pushing)
        self._pursuit = skill.pursuit

    def leading(self, wanted: Wanted, now: Situation) -> Array:
        """Commands that move the object as wanted: the base goes round the object's centre as it turns.

        v_base = v_object - ω × (object - base), in the heading frame. The hands rise by the height of the path, and
        once more by what the object lacks of it.
        """
        command = self.standing()
        rate = wanted.yaw_rate + self._pursuit.yaw * wrapped(wanted.heading - now.heading)
        command[:, :YAW_RATE] = turned(wanted.velocity, -now.heading)
        arm = turned(now.position[:, :2] - now.base[:, :2], -now.heading)
        command[:, 0] += rate * arm[:, 1]
        command[:, 1] -= rate * arm[:, 0]
        command[:, YAW_RATE] = rate
        self._raise(command, 2.0 * wanted.height - now.position[:, 2])
        return command

    def _raise(self, command: Array, height: Array) -> None:
        """Raises the hands by heights (n,) [m]: with the legs as far as they go, then with the arms."""
        low, high = self._commands.height
        legs = (command[:, HEIGHT] + height * ~self._pushing).clip(low, high)
        rest = command[:, HEIGHT] + height * ~self._pushing - legs
        command[:, HEIGHT] = legs
        command[:, OFFSET][:, 2::3] += rest[:, None]
