"""Legs that hold up the pelvis."""

import numpy as np
import pytest
from sagittal_plane import measured, sole

from iowbc.control.command import HEIGHT
from iowbc.control.feedback import LegStretch
from iowbc.control.stride import Stride
from iowbc.recipe.task.joint_references import GaitPrior, HeightFeedback
from iowbc.robot.description import Robot

PERIOD = 0.02


def test_the_legs_stretch_by_the_integral_of_what_the_pelvis_hangs_lower_than_commanded(robot: Robot) -> None:
    feedback = LegStretch(robot, HeightFeedback(integral=0.5, furthest=0.03))
    standing = measured(robot.default_position, np.zeros(len(robot.joints)), 0.0, 0.0)
    command, stretch = np.zeros((1, 11)), np.zeros((1, 1))
    command[:, HEIGHT] = feedback.odometry.height(standing).max() + 0.01
    for _ in range(50):
        stretch = feedback(stretch, standing, command, PERIOD)
    assert stretch[0, 0] == pytest.approx(0.5 * 0.01 * 1.0)
    command[:, HEIGHT] -= 0.1
    for _ in range(500):
        stretch = feedback(stretch, standing, command, PERIOD)
    assert stretch[0, 0] == -0.03


@pytest.mark.parametrize("stepping", [0.0, 1.0])
def test_stretched_legs_put_both_feet_lower_under_the_pelvis_standing_and_walking(
    robot: Robot, stepping: float
) -> None:
    stride = Stride(robot, GaitPrior(sway=0.0), held=True)
    posture, zero, command = robot.default_position[robot.support][None], np.zeros(1), np.zeros((1, 11))
    places = []
    for stretch in (0.0, 0.02):
        feedback = np.array([[0.0, 0.0, 0.0, stretch]])
        position = robot.default_position.copy()
        position[robot.support] = stride(posture, zero, command, zero, np.full(1, stepping), feedback)[0]
        places.append([sole(robot, position, 0.0, side) for side in range(2)])
    moved = np.array(places[1]) - places[0]
    np.testing.assert_allclose(moved, np.broadcast_to([0.0, -0.02], (2, 2)), atol=1e-4)


def test_without_the_setting_a_standing_robot_keeps_its_posture(robot: Robot) -> None:
    stride = Stride(robot, GaitPrior())
    posture, zero = robot.default_position[robot.support][None], np.zeros(1)
    kept = stride(posture, zero, np.zeros((1, 11)), zero, zero, np.array([[0.0, 0.0, 0.05, 0.02]]))
    np.testing.assert_array_equal(kept, posture)
