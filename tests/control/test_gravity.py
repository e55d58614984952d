"""The arms' feed-forward against the inverse dynamics of two simulators."""

from typing import Any

import mujoco
import numpy as np
import pinocchio
import pytest
from pinocchio_states import configuration

from iowbc.control.arms import ArmKinematics
from iowbc.reference.labels.support_model import build_model
from iowbc.robot import rotations
from iowbc.robot.description import GRAVITY, Robot

ROWS = 20
TILTS = {"upright": (0.0, 0.0, 0.0), "leaning": (0.0, 0.7, 0.0), "tilted": (0.3, -0.4, 2.0)}


def postures(robot: Robot) -> Any:
    return np.random.default_rng(0).uniform(robot.lower, robot.upper, (ROWS, len(robot.joints)))


def held(robot: Robot, joints: Any, base: Any, load: Any = None) -> Any:
    """The torques of `ArmKinematics` in a base attitude, quaternion wxyz."""
    down = np.tile(rotations.matrix(base).T @ [0.0, 0.0, -1.0], (len(joints), 1))
    return ArmKinematics(robot).torque(joints[:, robot.interaction], joints[:, 12:15], down, load)


@pytest.mark.parametrize("tilt", TILTS.values(), ids=TILTS)
def test_the_arms_own_weight_is_that_of_inverse_dynamics(robot: Robot, tilt: Any) -> None:
    joints, base = postures(robot), rotations.from_euler(*map(np.asarray, tilt))
    torque = held(robot, joints, base)
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf))
    other, data = build_model(robot), mujoco.MjData(model)
    other_data = other.createData()
    for row in range(ROWS):
        data.qpos[:] = np.concatenate([np.zeros(3), base, joints[row]])
        mujoco.mj_forward(model, data)
        assert torque[row] == pytest.approx(data.qfrc_bias[6:][robot.interaction], abs=1e-6)
        q = configuration(np.zeros(3), base, joints[row])
        expected = pinocchio.computeGeneralizedGravity(other, other_data, q)[6:][robot.interaction]
        assert torque[row] == pytest.approx(expected, abs=1e-6)


def test_a_load_adds_the_transposed_jacobian_of_its_weight(robot: Robot) -> None:
    joints, base = postures(robot), np.array([1.0, 0.0, 0.0, 0.0])
    joints[:, 12:15] = 0.0
    load = np.random.default_rng(1).uniform(0.0, 6.0, (ROWS, 2))
    added = held(robot, joints, base, load) - held(robot, joints, base)
    _, jacobian = ArmKinematics(robot).forward(joints[:, robot.interaction])
    expected = GRAVITY * load[:, :, None] * jacobian[:, :, 2]
    np.testing.assert_allclose(added, expected.reshape(ROWS, -1), atol=1e-12)


def test_what_moves_on_a_hinge_of_its_own_is_no_burden(robot: Robot) -> None:
    mass, moment = robot.tree.rigid_mass(robot.wrist_bodies[0])
    hand = robot.tree.bodies[robot.wrist_bodies[0]]
    assert mass == pytest.approx(hand.mass)
    assert moment == pytest.approx(hand.mass * hand.centre)
