"""A robot whose measurements cannot be true is held by itself, and its state says why."""

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iowbc.deploy.controller import Controller, Measured, Targets
from iowbc.deploy.plausibility import Limits
from iowbc.robot.description import Robot

NOMINAL = np.array([0, 0, 0, 0.72, 0, 0, 0, 0, 0, 0, 0.0])
WALKING = NOMINAL + 0.3 * np.eye(11)[0]


def measured(robot: Robot, rows: int = 1) -> Measured:
    return Measured(
        projected_gravity=np.tile([0.0, 0.0, -1.0], (rows, 1)),
        base_angular_velocity=np.zeros((rows, 3)),
        heading=np.zeros((rows, 1)),
        joint_position=np.tile(robot.default_position, (rows, 1)),
        joint_velocity=np.zeros((rows, 29)),
        object_position=np.tile([0.3, 0.0, 0.1], (rows, 1)),
        object_quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        object_linear_velocity=np.zeros((rows, 3)),
        object_angular_velocity=np.zeros((rows, 3)),
    )


def broken(robot: Robot, rows: int, row: int, **values: Any) -> Measured:
    """Measurements of which one robot's are replaced."""
    good = measured(robot, rows)
    for name, value in values.items():
        getattr(good, name)[row] = value
    return good


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"joint_velocity": np.nan}, r"joint_velocity\[left_hip_pitch_joint\] is nan"),
        ({"heading": np.inf}, r"heading\[0\] is inf"),
        ({"heading": 1e18}, r"heading\[0\] is 1e\+18"),
        ({"joint_position": 57.0}, r"joint_position\[left_hip_pitch_joint\] is 57, which is not between"),
        ({"joint_position": 1e300}, r"joint_position\[left_hip_pitch_joint\] is 1e\+300"),
        ({"joint_velocity": 400.0}, r"joint_velocity\[left_hip_pitch_joint\] is 400"),
        ({"base_angular_velocity": [0.0, 57.3, 0.0]}, r"base_angular_velocity\[1\] is 57.3"),
        ({"projected_gravity": 0.0}, "norm of projected_gravity is 0, which is not between 0.5 and 1.5"),
        ({"projected_gravity": [0.0, 0.0, -9.81]}, r"projected_gravity\[2\] is -9.81"),
        ({"object_quaternion": 0.0}, "norm of object_quaternion is 0"),
        ({"object_position": [300.0, 0.0, 100.0]}, r"object_position\[0\] is 300"),
    ],
)
def test_a_robot_with_an_impossible_measurement_is_held_and_the_others_go_on(
    exported: Path, robot: Robot, caplog: pytest.LogCaptureFixture, values: dict[str, Any], reason: str
) -> None:
    controller, whole = (Controller.load(exported, robots=3) for _ in range(2))
    before = controller.step(measured(robot, 3), NOMINAL)
    whole.step(measured(robot, 3), NOMINAL)
    with caplog.at_level(logging.WARNING):
        targets = [controller.step(broken(robot, 3, 1, **values), WALKING) for _ in range(3)][-1]
    others = [whole.step(measured(robot, 3), WALKING) for _ in range(3)][-1]
    assert targets.held.tolist() == [False, True, False]
    assert np.array_equal(targets.position[1], before.position[1])
    assert np.array_equal(targets.position[[0, 2]], others.position[[0, 2]])
    assert targets.reasons[0] == targets.reasons[2] == ""
    with pytest.raises(AssertionError, match=reason):
        raise AssertionError(targets.reasons[1])
    assert len(caplog.records) == 1
    assert not controller.step(measured(robot, 3), WALKING).held.any()


def test_a_robot_with_an_impossible_command_is_held_and_the_others_go_on(exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported, robots=2)
    controller.step(measured(robot, 2), NOMINAL)
    targets = controller.step(measured(robot, 2), np.stack([NOMINAL, np.full(11, np.nan)]))
    assert targets.reasons[0] == ""
    assert targets.reasons[1].startswith("command[v_x] is nan")


def test_without_a_good_measurement_joints_stay_where_they_are_known_to_be(exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported)
    blind = broken(robot, 1, 0, joint_position=np.nan)
    assert controller.step(blind, NOMINAL).position == pytest.approx(robot.default_position[None])
    controller.reset()
    controller.step(measured(robot), NOMINAL)
    controller.reset()
    assert controller.step(blind, NOMINAL).position == pytest.approx(robot.default_position[None])


def frozen(controller: Controller, robot: Robot, stamps: list[float | None]) -> list[Targets]:
    return [controller.step(measured(robot), WALKING, measured_at=stamp) for stamp in stamps]


@pytest.mark.parametrize("stamp", [None, 12.5, np.nan], ids=["equal values", "one time stamp", "no number"])
def test_frozen_measurements_hold_the_targets_after_a_tenth_of_a_second(
    exported: Path, robot: Robot, stamp: float | None
) -> None:
    controller = Controller.load(exported)
    targets = frozen(controller, robot, [stamp] * 1500)
    assert sum(target.held.all() for target in targets) >= 1493
    assert targets[-1].reasons[0].startswith("the sensors have delivered nothing new for 29.")
    jumps = np.abs(np.diff([target.position[0] for target in targets[7:]], axis=0))
    assert jumps.max() == 0.0


def test_time_stamps_that_go_on_keep_equal_values_fresh(exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported)
    assert not any(target.held.any() for target in frozen(controller, robot, [0.02 * step for step in range(50)]))


def test_limits_are_the_callers_to_widen(exported: Path, robot: Robot) -> None:
    odd = broken(robot, 1, 0, heading=2e5)
    assert Controller.load(exported).step(odd, NOMINAL).held.all()
    assert not Controller.load(exported, limits=Limits(heading=1e6)).step(odd, NOMINAL).held.any()


def test_a_missing_quantity_still_leaves_every_robot_as_it_was(exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported, robots=2)
    before = controller.state
    with pytest.raises(ValueError, match="heading: expected shape"):
        controller.step(replace(measured(robot, 2), heading=np.zeros(2)), NOMINAL)
    assert all(np.array_equal(before[name], value) for name, value in controller.state.items())
