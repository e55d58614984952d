"""Models of the G1 in MuJoCo and pinocchio, and random postures."""

from typing import Any

import mujoco
import numpy as np
import pytest

from iowbc.reference.labels.support_model import build_model
from iowbc.robot.description import Robot

CONFIGURATIONS = 100


@pytest.fixture(scope="session")
def mujoco_model(robot: Robot) -> Any:
    return mujoco.MjModel.from_xml_path(str(robot.mjcf))


@pytest.fixture(scope="session")
def pinocchio_model(robot: Robot) -> Any:
    return build_model(robot)


@pytest.fixture(scope="session")
def postures(robot: Robot) -> list[tuple[Any, Any, Any]]:
    """Base position, base quaternion wxyz, joint positions."""
    random = np.random.default_rng(0)
    quaternions = random.normal(size=(CONFIGURATIONS, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    places = random.uniform(-1.0, 1.0, (CONFIGURATIONS, 3))
    joints = random.uniform(robot.lower, robot.upper, (CONFIGURATIONS, len(robot.joints)))
    return list(zip(places, quaternions, joints, strict=True))
