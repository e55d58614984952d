"""An adapter is held against the robot, and the robot takes its gains and posture, before anything is played."""

from dataclasses import replace

import numpy as np
import pytest

from iowbc.adapters.adapter import Adapter, scaled, validate_adapter
from iowbc.adapters.source import robot_of
from iowbc.errors import StageFailed
from iowbc.robot.description import Robot, load_robot

pytestmark = pytest.mark.unit


@pytest.fixture
def adapter(robot: Robot) -> Adapter:
    joints = robot.joints
    return Adapter(
        joints=joints,
        default=robot.default_position,
        kp=np.full(len(joints), 40.0),
        kd=np.full(len(joints), 2.5),
        acted=tuple(joints[index] for index in robot.support),
        scale=np.full(len(robot.support), 0.25),
        frequency=50.0,
        terms=(scaled("gravity"), scaled("joint_velocity", 0.05)),
        network=lambda observation: observation[:, :15],
    )


def test_a_fitting_adapter_passes(robot: Robot, adapter: Adapter) -> None:
    validate_adapter(adapter, robot, 50.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"joints": ("left_elbow",)},
            "joints: unknown or repeated .'left_elbow'.; valid, once each: left_hip_pitch_joint",
        ),
        ({"acted": ("left_knee_joint",) * 2}, "acted: unknown or repeated .'left_knee_joint'."),
        ({"acted": ("left_knee_joint",), "scale": np.ones(1)}, "acted: lacks left_hip_pitch_joint"),
        ({"kp": np.ones(3)}, r"kp: has shape \(3,\), expected \(29,\) finite numbers"),
        ({"kd": np.full(29, -1.0)}, r"kd: has the negative gain -1, which would drive its joint away"),
        ({"default": np.full(29, np.nan)}, r"default: has shape \(29,\), not all of it finite numbers, expected"),
        ({"default": np.full(29, 5.0)}, "default: left_hip_pitch_joint is 5 rad, its range -2.53 to 2.88 rad"),
        ({"frequency": 100.0}, "is 100 Hz, the trials run at 50 Hz; set task.control_frequency"),
        ({"history": 0}, "history: is 0"),
        ({"ranges": {"yaw": (-1.0, 1.0)}}, "ranges: yaw: no such velocity; valid: v_x, v_y, yaw_rate"),
        ({"ranges": {"v_x": (1.0, -0.5)}}, r"ranges: v_x: is \(1.0, -0.5\), expected its smallest and its largest"),
        ({"ranges": {"v_x": 1.0}}, "ranges: v_x: is 1.0, expected its smallest and its largest value"),
        ({"frequency": "50"}, r"frequency: is '50', expected a number \[Hz\]"),
        ({"terms": (scaled("gravity"), lambda seen: np.zeros(3))}, r"number 1 \(from 0\) gives shape \(3,\) for one"),
        ({"terms": (scaled("gravity", np.nan),)}, "number 0 .* not all of it finite numbers"),
        ({"network": lambda observation: observation}, r"gives shape \(1, 32\) for an observation of 32 numbers"),
        ({"network": lambda observation: observation[:, 40]}, "cannot make a step: IndexError"),
    ],
)
def test_what_does_not_fit_is_named(robot: Robot, adapter: Adapter, changes: dict[str, object], message: str) -> None:
    with pytest.raises(StageFailed, match=message):
        validate_adapter(replace(adapter, **changes), robot, 50.0)


def test_arms_of_its_own_need_all_arm_joints(robot: Robot, adapter: Adapter) -> None:
    text = "acted: lacks left_shoulder_pitch_joint, .*; a controller without arms of its own needs arms: measured or"
    with pytest.raises(StageFailed, match=text):
        validate_adapter(adapter, robot, 50.0, moves_arms=True)
    whole = replace(adapter, acted=robot.joints, scale=np.full(29, 0.25), network=lambda seen: seen[:, :29])
    validate_adapter(whole, robot, 50.0, moves_arms=True)


@pytest.mark.parametrize("moves_arms", [False, True])
def test_the_joints_that_it_moves_take_its_gains_and_legs_and_waist_its_posture(
    robot: Robot, adapter: Adapter, moves_arms: bool
) -> None:
    posture = np.where(["knee" in name for name in robot.joints], 0.5, robot.default_position)
    unused = posture + 0.1 * np.isin(np.arange(len(posture)), robot.interaction)
    made = load_robot(robot_of(replace(adapter, default=unused), robot, moves_arms=moves_arms))
    for index in robot.support:
        assert (made.kp[index], made.kd[index]) == (40.0, 2.5)
    np.testing.assert_array_equal(made.kp[robot.interaction], 40.0 if moves_arms else robot.kp[robot.interaction])
    np.testing.assert_array_equal(made.default_position, posture)
    np.testing.assert_array_equal(made.effort, robot.effort)


def test_sides_that_differ_are_refused(robot: Robot, adapter: Adapter) -> None:
    kp = adapter.kp.copy()
    kp[robot.joints.index("right_knee_joint")] = 41.0
    with pytest.raises(StageFailed, match="right_knee_joint differs from the other side"):
        robot_of(replace(adapter, kp=kp), robot)
