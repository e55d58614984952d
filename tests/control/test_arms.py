"""Differential inverse kinematics of the arms: reach, singular postures, limits, redundancy (paper eq. 2, 3)."""

from typing import Any

import numpy as np
import pytest

from iowbc.control.arms import ArmKinematics
from iowbc.recipe.task.joint_references import ArmReference
from iowbc.robot.description import Robot

PERIOD = 0.02
"""Control period [s]."""


@pytest.fixture(scope="module")
def arms(robot: Robot) -> ArmKinematics:
    return ArmKinematics(robot)


def grasp(x: float, y: float, z: float) -> Any:
    """Wrist targets (1, 2, 3) in the torso frame, the right one mirrored."""
    return np.array([[[x, y, z], [x, -y, z]]])


def test_wrists_reach_carrying_poses(arms: ArmKinematics) -> None:
    for x in (0.18, 0.24, 0.3):
        for y in (0.12, 0.18, 0.24):
            for z in (0.1, 0.2, 0.3):
                target = grasp(x, y, z)
                wrist, _ = arms.forward(arms.solve(arms.rest[None], target))
                assert np.abs(wrist - target).max() < 2e-3, (x, y, z)


def test_a_commanded_offset_is_followed_in_control_steps(arms: ArmKinematics) -> None:
    posture = arms.solve(arms.rest[None], grasp(0.25, 0.16, 0.1))
    for step in range(100):
        posture = arms.solve_step(posture, grasp(0.25 + 0.001 * min(step, 50), 0.16, 0.1), PERIOD)
    wrist, _ = arms.forward(posture)
    assert np.abs(wrist - grasp(0.30, 0.16, 0.1)).max() < 2e-3


@pytest.mark.parametrize("target", [grasp(2.0, 0.3, 0.5), grasp(0.0, 0.1, 1.5), grasp(-1.0, 0.5, 0.2)])
def test_out_of_reach_the_arm_stretches_towards_the_target_and_comes_to_rest(arms: ArmKinematics, target: Any) -> None:
    posture = arms.solve(arms.rest[None], target, steps=400, dt=PERIOD)
    again = arms.solve_step(posture, target, PERIOD)
    assert np.isfinite(posture).all()
    assert np.abs(again - posture).max() < 2e-3
    before, _ = arms.forward(arms.rest[None])
    after, _ = arms.forward(posture)
    assert (np.linalg.norm(after - target, axis=-1) < np.linalg.norm(before - target, axis=-1)).all()


def test_next_to_a_straight_elbow_steps_stay_bounded(robot: Robot, arms: ArmKinematics) -> None:
    straight = np.zeros((1, 14))
    names = [robot.joints[index] for index in robot.interaction]
    straight[0, [names.index(f"{side}_elbow_joint") for side in ("left", "right")]] = np.pi / 2
    _, jacobian = arms.forward(straight)
    singular = np.linalg.svd(jacobian[0], compute_uv=False)[:, -1]
    assert (singular < 0.05).all(), "the posture was chosen to be nearly singular"
    wrist, _ = arms.forward(straight)
    outward = wrist + 0.02 * wrist / np.linalg.norm(wrist, axis=-1, keepdims=True)
    step = arms.solve_step(straight, outward, 1.0) - straight
    damped = 0.02 / (2.0 * arms.settings.damping)
    drawn = np.abs(arms.settings.posture_gain * (arms.rest - straight)).max() * np.sqrt(7)
    assert np.linalg.norm(step.reshape(2, 7), axis=1).max() < damped + drawn


def test_references_keep_to_joint_ranges_and_joint_speed(robot: Robot) -> None:
    arms = ArmKinematics(robot, ArmReference(joint_speed=2.0))
    random = np.random.default_rng(0)
    posture = np.tile(arms.rest, (64, 1))
    for _ in range(60):
        following = arms.solve_step(posture, random.uniform(-1.0, 1.0, (64, 2, 3)), PERIOD)
        assert (np.abs(following - posture) <= 2.0 * PERIOD + 1e-12).all()
        assert (following >= arms.lower).all()
        assert (following <= arms.upper).all()
        posture = following


def test_the_same_wrists_give_the_rest_posture_back(arms: ArmKinematics) -> None:
    target, _ = arms.forward(arms.rest[None])
    elbows_out = arms.rest + 0.3 * np.random.default_rng(1).uniform(-1, 1, 14)
    posture = arms.solve(elbows_out[None], target, steps=300)
    np.testing.assert_allclose(posture[0], arms.rest, atol=0.02)


def test_rows_do_not_influence_each_other(arms: ArmKinematics) -> None:
    random = np.random.default_rng(2)
    start, target = arms.rest + 0.2 * random.normal(size=(5, 14)), random.uniform(0.1, 0.4, (5, 2, 3))
    together = arms.solve_step(start, target, PERIOD)
    for row in range(5):
        alone = arms.solve_step(start[row : row + 1], target[row : row + 1], PERIOD)
        np.testing.assert_allclose(together[row], alone[0], atol=1e-12)
