"""Hips that hold up the torso."""

import numpy as np
import pytest
from sagittal_plane import measured

from iowbc.control.command import PITCH
from iowbc.control.feedback import HipFeedback
from iowbc.control.legs import leg_joints
from iowbc.control.sensors import Measured
from iowbc.recipe.task.joint_references import TorsoFeedback
from iowbc.robot.description import Robot

SETTINGS = TorsoFeedback(integral=0.3, furthest=0.2, least=0.05)
PERIOD = 0.02


@pytest.fixture(scope="module")
def feedback(robot: Robot) -> HipFeedback:
    return HipFeedback(robot, SETTINGS)


def leaning(robot: Robot, pelvis: float, waist: float) -> Measured:
    """A robot whose pelvis and waist are pitched so far."""
    position = robot.default_position.copy()
    position[robot.support[robot.waist_pitch]] = waist
    return measured(position, 0.0 * position, pelvis, 0.0)


@pytest.mark.parametrize(("further", "end"), [(0.3, 0.2), (-0.3, -0.05)])
def test_the_hips_turn_by_the_integral_of_what_the_torso_leans_further_than_commanded(
    robot: Robot, feedback: HipFeedback, further: float, end: float
) -> None:
    command, turn = np.zeros((1, 11)), np.zeros((1, 1))
    command[:, PITCH] = 0.4
    for _ in range(20):
        turn = feedback(turn, leaning(robot, 0.1, 0.3 + further / 10.0), command, PERIOD)
    assert turn[0, 0] == pytest.approx(0.3 * further / 10.0 * 20 * PERIOD)
    for _ in range(500):
        turn = feedback(turn, leaning(robot, 0.1, 0.3 + further), command, PERIOD)
    assert turn[0, 0] == end


def test_legs_that_keep_their_place_turn_the_pelvis_back(robot: Robot, feedback: HipFeedback) -> None:
    support = robot.default_position[robot.support][None]
    moved = feedback.turned(support, np.array([[0.1]])) - support
    hips = [leg[0] for leg in leg_joints(robot)]
    np.testing.assert_allclose(moved[0, hips], 0.1)
    assert np.count_nonzero(moved) == 2
    for side, leg in enumerate(leg_joints(robot)):
        angles = dict(zip(robot.joints, robot.default_position, strict=True))
        before, _ = robot.tree.forward(angles, robot.base, robot.soles[side])
        angles[robot.joints[robot.support[leg[0]]]] += 0.1
        after, _ = robot.tree.forward(angles, robot.base, robot.soles[side])
        assert after[0] < before[0], "the foot goes back under the pelvis, or the pelvis leans back over it"
