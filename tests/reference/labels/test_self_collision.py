"""Distances between the robot's capsules, against MuJoCo."""

import mujoco
import numpy as np
import pinocchio
import pytest

from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.checks import SelfCollision
from iowbc.reference.labels.support_model import SupportModel
from iowbc.robot.description import Robot


@pytest.fixture(params=["robot", "robot_of_23"])
def either(request: pytest.FixtureRequest, recipe: ReferenceGenerator) -> SupportModel:
    """That of a robot whose every body has a hinge, and of one with bodies that are fixed to others."""
    return SupportModel(request.getfixturevalue(request.param), recipe.problem)


def test_capsule_distances_are_mujocos(either: SupportModel) -> None:
    robot, support = either.robot, either
    collision = SelfCollision(robot, support.full)
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf))
    data = mujoco.MjData(model)
    geoms = [model.geom(name).id for name in collision.names]
    random = np.random.default_rng(2)
    negative = 0
    for _ in range(40):
        joints = random.uniform(0.6 * robot.lower, 0.6 * robot.upper)
        data.qpos[:] = np.concatenate([[0, 0, 0, 1, 0, 0, 0], joints])
        mujoco.mj_kinematics(model, data)
        pinocchio.forwardKinematics(support.full, support.full_data, np.concatenate([[0, 0, 0, 0, 0, 0, 1], joints]))
        clearance = collision.clearance(support.full_data)
        expected = min(mujoco.mj_geomDistance(model, data, geoms[a], geoms[b], 1.0, None) for a, b in collision.pairs)
        assert clearance == pytest.approx(expected, abs=2e-4)
        negative += clearance < 0.0
    assert 0 < negative < 40


def test_neighbours_in_the_chain_are_not_checked(robot: Robot, support: SupportModel) -> None:
    collision = SelfCollision(robot, support.full)
    names = {frozenset((collision.names[a], collision.names[b])) for a, b in collision.pairs}
    assert frozenset(("left_hand", "right_hand")) in names
    assert frozenset(("left_knee", "left_shin")) not in names
    assert frozenset(("left_elbow", "left_wrist_pitch")) not in names


def test_what_is_fixed_to_a_link_is_as_near_to_others_as_the_link(
    robot_of_23: Robot, recipe: ReferenceGenerator
) -> None:
    collision = SelfCollision(robot_of_23, SupportModel(robot_of_23, recipe.problem).full)
    names = {frozenset((collision.names[a], collision.names[b])) for a, b in collision.pairs}
    assert frozenset(("left_hand", "right_hand")) in names
    assert frozenset(("left_elbow", "left_hand")) not in names
    assert frozenset(("torso", "right_hand")) in names


def test_the_default_posture_touches_nothing(either: SupportModel) -> None:
    robot, support = either.robot, either
    q = np.concatenate([[0, 0, 0, 0, 0, 0, 1], robot.default_position])
    pinocchio.forwardKinematics(support.full, support.full_data, q)
    assert SelfCollision(robot, support.full).clearance(support.full_data) > 0.0
