"""The residual action a of the support branch."""

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.task.task import Action
from iowbc.robot.description import Robot
from iowbc.robot.mirror import MirrorMap, support_mirror


def action_scale(robot: Robot, action: Action) -> Array:
    """Radians of joint target that a unit of each action adds, (support joints,): the recipe's, or the robot's own."""
    return robot.action_scale if action.scale is None else np.full(len(robot.support), action.scale)


def applied_action(action: Array, previous: Array, task: Action) -> Array:
    """The action that the motors follow, (n, support joints), from the policy's and the one before."""
    share = task.previous_share
    return (1.0 - share) * action + share * previous if share else action


def action_mirror(robot: Robot) -> MirrorMap:
    """Mirror of the action, (support joints,), float32 as the networks are."""
    return support_mirror(robot).as_float32()
