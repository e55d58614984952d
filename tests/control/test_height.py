"""The base's speed and height by the legs, and legs that hold up the pelvis."""

from typing import Any

import numpy as np
import pytest

from iowbc.control.command import HEIGHT
from iowbc.control.height import LegStretch
from iowbc.control.legs import leg_joints
from iowbc.control.odometry import LegOdometry
from iowbc.control.sensors import Measured
from iowbc.control.stride import Stride
from iowbc.recipe.task.joint_references import GaitPrior, HeightFeedback
from iowbc.robot.description import Robot

PERIOD, STEP = 0.02, 1e-6


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


def sole(robot: Robot, position: Any, pitch: float, side: int) -> tuple[float, float]:
    """A sole ahead of and above the base, heading frame [m]."""
    place, _ = robot.tree.forward(dict(zip(robot.joints, position, strict=True)), robot.base, robot.soles[side])
    cosine, sine = np.cos(pitch), np.sin(pitch)
    return cosine * place[0] + sine * place[2], cosine * place[2] - sine * place[0]


def measured(robot: Robot, position: Any, velocity: Any, pitch: float, rate: float) -> Measured:
    return Measured(
        projected_gravity=np.array([[np.sin(pitch), 0.0, -np.cos(pitch)]]),
        base_angular_velocity=np.array([[0.0, rate, 0.0]]),
        heading=np.zeros((1, 1)),
        joint_position=position[None],
        joint_velocity=velocity[None],
    )


@pytest.mark.parametrize("seed", range(5))
def test_speed_and_height_are_those_of_a_base_over_feet_at_rest(robot: Robot, seed: int) -> None:
    random = np.random.default_rng(seed)
    position, velocity = sagittal(robot, random)
    pitch, rate = random.uniform(-0.3, 0.5), random.uniform(-1.0, 1.0)
    odometry, felt = LegOdometry.of(robot), measured(robot, position, velocity, pitch, rate)
    for side in range(2):
        ends = [sole(robot, position + way * velocity, pitch + way * rate, side)[0] for way in (-STEP, STEP)]
        assert odometry.speed(felt)[0, side] == pytest.approx(-(ends[1] - ends[0]) / (2.0 * STEP), abs=0.01)
        assert odometry.height(felt)[0, side] == pytest.approx(-sole(robot, position, pitch, side)[1], abs=0.002)


def test_the_legs_stretch_by_the_integral_of_what_the_pelvis_hangs_lower_than_commanded(robot: Robot) -> None:
    feedback = LegStretch.of(robot, HeightFeedback(integral=0.5, furthest=0.03))
    assert feedback is not None
    standing = measured(robot, robot.default_position, np.zeros(len(robot.joints)), 0.0, 0.0)
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
    stride = Stride.of(robot, GaitPrior(sway=0.0), held=True)
    assert stride is not None
    posture, zero, command = robot.default_position[robot.support][None], np.zeros(1), np.zeros((1, 11))
    places = []
    for stretch in (0.0, 0.02):
        feedback = np.array([[0.0, 0.0, 0.0, stretch]])
        position = robot.default_position.copy()
        position[robot.support] = stride(posture, zero, command, zero, np.full(1, stepping), feedback)[0]
        places.append([sole(robot, position, 0.0, side) for side in range(2)])
    moved = np.array(places[1]) - places[0]
    np.testing.assert_allclose(moved, np.broadcast_to([0.0, -0.02], (2, 2)), atol=1e-4)


def test_without_the_setting_there_is_none_and_a_standing_robot_keeps_its_posture(robot: Robot) -> None:
    assert LegStretch.of(robot, None) is None
    stride = Stride.of(robot, GaitPrior())
    assert stride is not None
    posture, zero = robot.default_position[robot.support][None], np.zeros(1)
    kept = stride(posture, zero, np.zeros((1, 11)), zero, zero, np.array([[0.0, 0.0, 0.05, 0.02]]))
    np.testing.assert_array_equal(kept, posture)
