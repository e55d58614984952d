"""The nominal commands of a skill."""

import numpy as np
import pytest

from iowbc.control.command import HEIGHT, PITCH
from iowbc.control.skill_command import SkillCommand
from iowbc.recipe.skill.skill import RobotAgent
from iowbc.recipe.task.commands import Commands


@pytest.mark.parametrize(("given", "height"), [(None, Commands().nominal_height), (0.66, 0.66)])
def test_only_robots_with_a_crate_take_the_posture_of_a_push(given: float | None, height: float) -> None:
    commands, robot = Commands(), RobotAgent(push_height=given, push_pitch=0.4)
    standing = SkillCommand(robot, commands, np.array([True, False])).standing()
    np.testing.assert_array_equal(standing[:, [HEIGHT, PITCH]], [[height, 0.4], [commands.nominal_height, 0.0]])
