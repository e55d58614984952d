"""Foot placement by the felt speed."""

from typing import Any

import numpy as np
import pytest
from sagittal_plane import measured

from iowbc.control.feedback import FootPlacement
from iowbc.control.sensors import Measured
from iowbc.control.stride import Stride
from iowbc.recipe.task.joint_references import GaitPrior, Placement
from iowbc.robot.description import Robot

FEEDBACK = Placement(gain=0.2, longest=0.25, filter_time=0.001)
PRIOR = GaitPrior(placement=FEEDBACK)
PERIOD = 0.02


@pytest.fixture(scope="module")
def placement(robot: Robot) -> FootPlacement:
    return FootPlacement(robot, PRIOR, FEEDBACK)


def moving(robot: Robot, speed: float) -> Measured:
    """A robot in its default posture that turns over its feet at such a speed."""
    position = robot.default_position
    unit = FootPlacement(robot, PRIOR, FEEDBACK)
    still = np.zeros(len(position))
    per_rate = unit.odometry.speed(measured(position, still, 0.0, 1.0)).mean()
    return measured(position, still, 0.0, speed / per_rate)


@pytest.mark.parametrize("excess", [0.4, -0.3])
@pytest.mark.parametrize("start", [0.0, 0.5])
def test_a_swinging_foot_lands_where_the_speed_beyond_the_commanded_one_asks_for(
    robot: Robot, placement: FootPlacement, excess: float, start: float
) -> None:
    command = np.zeros((1, 11))
    command[:, 0] = 0.3
    foothold, ones, swinging = np.zeros((1, 3)), np.ones(1), 1 if start == 0.0 else 0
    for phase in np.arange(PRIOR.stance - 0.5, 0.5, PRIOR.frequency * PERIOD) + start:
        foothold = placement(foothold, moving(robot, 0.3 + excess), command, np.array([phase % 1.0]), ones, PERIOD)
    assert foothold[0, swinging] == pytest.approx(0.2 * excess, rel=0.1)
    assert foothold[0, 1 - swinging] == 0.0, "the other foot stands"


def test_a_foot_on_the_ground_comes_back_and_no_step_is_longer_than_allowed(
    robot: Robot, placement: FootPlacement
) -> None:
    command, ones = np.zeros((1, 11)), np.ones(1)
    fast = moving(robot, 9.0)
    landed = placement(np.array([[0.2, 0.0, 0.0]]), fast, command, np.array([0.2]), ones, PERIOD)
    assert landed[0, 0] == pytest.approx(0.2 * np.exp(-PERIOD / FEEDBACK.return_time))
    landing = placement(np.array([[0.0, 0.25, 0.0]]), fast, command, np.array([0.49]), ones, PERIOD)
    assert landing[0, 1] == pytest.approx(0.25)
    still = placement(np.array([[0.2, 0.2, 0.0]]), fast, command, np.zeros(1), np.zeros(1), PERIOD)
    np.testing.assert_array_equal(still, 0.0)


def test_both_feet_trail_by_the_way_that_the_robot_stays_behind_and_come_back_where_it_stands(robot: Robot) -> None:
    settings = FEEDBACK.model_copy(update={"integral": 0.1, "longest_trim": 0.05})
    placement = FootPlacement(robot, PRIOR, settings)
    command, ones, trims = np.zeros((1, 11)), np.ones(1), []
    command[:, 0] = 0.4
    foothold = np.zeros((1, 3))
    for step in range(250):
        phase = np.array([step * PERIOD * PRIOR.frequency % 1.0])
        foothold = placement(foothold, moving(robot, 0.15), command, phase, ones, PERIOD)
        trims.append(foothold[0, 2])
    assert trims[49] == pytest.approx(-0.1 * 0.25 * 1.0, rel=1e-6), "a tenth of the 0.25 m of a second"
    assert trims[-1] == -0.05
    still = placement(foothold, moving(robot, 0.0), command, np.zeros(1), np.zeros(1), PERIOD)
    assert still[0, 2] == pytest.approx(-0.05 * np.exp(-PERIOD / settings.return_time))


def test_the_stride_moves_each_foot_by_its_own_way_and_by_that_of_both(robot: Robot) -> None:
    stride = Stride(robot, GaitPrior(placement=FEEDBACK))
    posture, zero, one = robot.default_position[robot.support][None], np.zeros(1), np.ones(1)
    command = np.zeros((1, 11))

    def moved(*foothold: float) -> Any:
        return stride(posture, zero, command, zero, one, np.array([foothold]))

    np.testing.assert_allclose(moved(0.01, -0.02, -0.03, 0.0), moved(-0.02, -0.05, 0.0, 0.0), atol=1e-12)
    assert np.abs(moved(0.0, 0.0, -0.03, 0.0) - moved(0.0, 0.0, 0.0, 0.0)).max() > 0.01
