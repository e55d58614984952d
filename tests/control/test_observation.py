"""The list of the observation's parts, and what follows from it."""

from typing import Any

import numpy as np
import pytest

from iowbc.control import observation
from iowbc.control.layout import Part
from iowbc.control.observation import PolicyInputs, observation_layout
from iowbc.control.sensors import Measured, quantities
from iowbc.robot.description import Robot
from iowbc.robot.mirror import scalar

ROWS = 4


def sensed(robot: Robot) -> PolicyInputs:
    random = np.random.default_rng(0)
    arrays: dict[str, Any] = {
        name: random.normal(size=(ROWS, len(what.kind(robot))))
        for name, what in (quantities(of_object=False) | quantities(of_object=True)).items()
    }
    support = len(robot.support)
    return PolicyInputs(
        measured=Measured(**arrays),
        command=random.normal(size=(ROWS, 11)),
        heading_reference=random.normal(size=(ROWS, 1)),
        joint_reference=random.normal(size=(ROWS, len(robot.joints))),
        phase=random.normal(size=(ROWS, 2)),
        last_action=random.normal(size=(ROWS, support)),
        support_reference=random.normal(size=(ROWS, support)),
        arm_reference=random.normal(size=(ROWS, len(robot.interaction))),
    )


def test_a_row_holds_the_parts_in_order(robot: Robot) -> None:
    layout, seen = observation_layout(robot, observe_object=True), sensed(robot)
    row = layout.gather(seen, np.empty((ROWS, layout.size), np.float32))
    assert [(name, place.stop - place.start) for name, place in layout.slices.items()] == [
        ("command", 11),
        ("projected_gravity", 3),
        ("base_angular_velocity", 3),
        ("heading_error", 1),
        ("joint_position", 29),
        ("joint_velocity", 29),
        ("phase", 2),
        ("last_action", 15),
        ("support_reference", 15),
        ("arm_reference", 14),
        ("object_position", 3),
        ("object_orientation", 3),
        ("object_linear_velocity", 3),
        ("object_angular_velocity", 3),
    ]
    deviation = seen.measured.joint_position - seen.joint_reference
    assert row[:, layout.slices["joint_position"]] == pytest.approx(deviation.astype(np.float32))
    assert row[:, layout.slices["last_action"]] == pytest.approx(seen.last_action.astype(np.float32))


def test_some_rows_are_those_of_all(robot: Robot) -> None:
    layout, seen, which = observation_layout(robot, observe_object=True), sensed(robot), np.array([3, 1])
    every = layout.gather(seen, np.empty((ROWS, layout.size), np.float32))
    some = layout.gather(seen, np.empty((2, layout.size), np.float32), which)
    assert np.array_equal(some, every[which])


def test_a_quaternion_and_its_opposite_are_one_orientation(robot: Robot) -> None:
    seen = sensed(robot)
    turned = seen.measured.object_quaternion
    vector = observation.object_orientation(seen)
    turned *= -1.0  # type: ignore[operator]
    np.testing.assert_array_equal(observation.object_orientation(seen), vector)


def downhill(seen: PolicyInputs) -> Any:
    return seen.measured.projected_gravity[:, :1]


def test_another_part_is_a_function_and_a_line(robot: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    before = observation_layout(robot, observe_object=True)
    added = Part("downhill", scalar, "1", "base", downhill)
    monkeypatch.setattr(observation, "PROPRIOCEPTION", (*observation.PROPRIOCEPTION, added))
    layout, seen = observation_layout(robot, observe_object=True), sensed(robot)
    assert layout.size == before.size + 1
    assert len(layout.mirror) == layout.size
    row = layout.gather(seen, np.empty((ROWS, layout.size), np.float32))
    assert row[:, layout.slices["downhill"]] == pytest.approx(downhill(seen), abs=1e-6)
    assert {"name": "downhill", "size": 1, "unit": "1", "frame": "base"} in layout.describe()


def test_the_heading_error_turns_with_the_base_and_wraps(robot: Robot) -> None:
    layout, seen = observation_layout(robot, observe_object=False), sensed(robot)
    seen.measured.heading[:, 0], seen.heading_reference[:, 0] = [0.3, 3.1, -3.1, 7.0], [0.1, -3.1, 3.1, 0.5]
    row = layout.gather(seen, np.empty((ROWS, layout.size), np.float32))
    turned = [0.2, 6.2 - 2 * np.pi, 2 * np.pi - 6.2, 6.5 - 2 * np.pi]
    assert row[:, layout.slices["heading_error"]][:, 0] == pytest.approx(turned, abs=1e-6)
