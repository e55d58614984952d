"""Whatever sensors and commander say: a step is refused without a trace, or its targets can be followed."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iowbc.deploy.controller import Controller, Measured
from iowbc.robot.description import Robot

NOMINAL = np.array([0, 0, 0, 0.72, 0, 0, 0, 0, 0, 0, 0.0])
SHAPES = {
    "projected_gravity": 3,
    "base_angular_velocity": 3,
    "heading": 1,
    "joint_position": 29,
    "joint_velocity": 29,
    "object_position": 3,
    "object_quaternion": 4,
    "object_linear_velocity": 3,
    "object_angular_velocity": 3,
}
ORDINARY = st.floats(-3.0, 3.0)
ODD = st.sampled_from([0.0, np.nan, np.inf, -np.inf, 1e300, 3e38, -3e38, 1e20, 1e-300])


def numbers(size: int) -> st.SearchStrategy[np.ndarray]:
    """A row of ordinary numbers, of which one may be odd."""
    rows = st.lists(ORDINARY, min_size=size, max_size=size).map(lambda row: np.array([row]))
    return rows | st.tuples(rows, st.integers(0, size - 1), ODD).map(replaced)


def replaced(drawn: tuple[np.ndarray, int, float]) -> np.ndarray:
    row, place, value = drawn
    row[0, place] = value
    return row


@pytest.fixture(scope="module")
def controller(exported: Path) -> Controller:
    return Controller.load(exported)


@settings(max_examples=60, deadline=None, derandomize=True, database=None)
@given(
    said=st.fixed_dictionaries({name: numbers(size) for name, size in SHAPES.items()}),
    command=numbers(11).map(lambda row: row[0]),
)
def test_targets_can_be_followed_and_the_past_is_kept_of_a_robot_whose_values_cannot_be_true(
    controller: Controller, robot: Robot, said: dict[str, np.ndarray], command: np.ndarray
) -> None:
    assert {field.name for field in fields(Measured)} >= said.keys()
    controller.reset()
    quiet = Measured(
        **{name: np.zeros((1, size)) for name, size in SHAPES.items()}
        | {"object_quaternion": np.eye(4)[:1], "projected_gravity": -np.eye(3)[2:]}
    )
    first = controller.step(quiet, NOMINAL)
    assert first.reasons == ("",)
    before = controller.state
    targets = controller.step(Measured(**said), command)
    assert targets.held.tolist() == [targets.reasons != ("",)]
    values = np.concatenate([command, *(value[0] for value in said.values())])
    if not (np.abs(values) < 1e6).all():
        assert "is not between" in targets.reasons[0]
    if "is not between" in targets.reasons[0]:
        assert all(np.array_equal(before[name], value) for name, value in controller.state.items())
        assert np.array_equal(targets.position, first.position)
    assert np.isfinite(targets.position).all()
    reach = robot.velocity_limit / controller.frequency
    assert (np.abs(targets.position - first.position) <= reach + 1e-9).all()
    for time in range(3):
        assert np.isfinite(controller.step(quiet, NOMINAL, measured_at=time).position).all()
