"""Speed and height of the base by the legs."""

from typing import Any

import numpy as np
import pytest
from sagittal_plane import measured, sole

from iowbc.control.feedback import LegOdometry
from iowbc.control.legs import leg_joints
from iowbc.robot.description import Robot

STEP = 1e-6


def sagittal(robot: Robot, random: np.random.Generator) -> tuple[Any, Any]:
    """Positions and velocities of all joints; of the legs only those about the lateral axis differ from the default."""
    position, velocity = robot.default_position.copy(), np.zeros(len(robot.joints))
    for leg in leg_joints(robot):
        for joint in (0, 3, 4):
            place = robot.support[leg[joint]]
            position[place] += random.uniform(-0.3, 0.3)
            velocity[place] = random.uniform(-2.0, 2.0)
        for joint in (1, 2, 5):
            position[robot.support[leg[joint]]] = 0.0
    return position, velocity


@pytest.mark.parametrize("seed", range(5))
def test_speed_and_height_are_those_of_a_base_over_feet_at_rest(robot: Robot, seed: int) -> None:
    random = np.random.default_rng(seed)
    position, velocity = sagittal(robot, random)
    pitch, rate = random.uniform(-0.3, 0.5), random.uniform(-1.0, 1.0)
    odometry, felt = LegOdometry(robot), measured(position, velocity, pitch, rate)
    for side in range(2):
        ends = [sole(robot, position + way * velocity, pitch + way * rate, side)[0] for way in (-STEP, STEP)]
        assert odometry.speed(felt)[0, side] == pytest.approx(-(ends[1] - ends[0]) / (2.0 * STEP), abs=0.01)
        assert odometry.height(felt)[0, side] == pytest.approx(-sole(robot, position, pitch, side)[1], abs=0.002)
