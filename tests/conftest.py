"""The robot that most tests are about."""

import pytest

from iowbc.robot.description import Robot, load_robot, robot_folder


@pytest.fixture(scope="session")
def robot() -> Robot:
    return load_robot(robot_folder("g1"))
