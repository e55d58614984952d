"""Targets that no joint could follow are not passed on."""

import logging

import numpy as np
import pytest

from iowbc.deploy.plausibility import TargetGuard

LIMIT = np.array([10.0, 20.0])
"""Speed of two joints [rad/s]; in a period of 0.02 s they move by 0.2 and 0.4 rad."""
NOBODY, EVERYBODY = np.zeros(1, bool), np.ones(1, bool)
MEASURED = np.array([[0.5, -0.5]])


def started() -> TargetGuard:
    guard = TargetGuard(1, LIMIT, 0.02)
    guard.passed(np.array([[0.0, 0.0]]), EVERYBODY, MEASURED)
    return guard


@pytest.mark.parametrize("factor", [1.0, 1.4])
def test_a_target_that_asks_for_a_torque_is_passed_on(factor: float) -> None:
    wanted = [[0.2 * factor, -0.4 * factor]]
    passed, why = started().passed(np.array(wanted), NOBODY, MEASURED)
    assert passed.tolist() == wanted
    assert not any(why)


@pytest.mark.parametrize("wrong", [[9.0, 0.0], [0.0, -9.0], [np.nan, 0.0], [0.0, np.inf]])
def test_a_jump_or_no_number_holds_all_joints_and_is_said_once(
    wrong: list[float], caplog: pytest.LogCaptureFixture
) -> None:
    guard = started()
    with caplog.at_level(logging.WARNING):
        for _ in range(2):
            passed, why = guard.passed(np.array([wrong]), NOBODY, MEASURED)
            assert passed.tolist() == [[0.0, 0.0]]
            assert all(why)
    assert len(caplog.records) == 1
    assert "robot 0" in caplog.text
    passed, why = guard.passed(np.array([[0.1, 0.1]]), NOBODY, MEASURED)
    assert passed.tolist() == [[0.1, 0.1]]
    assert not any(why)


def test_a_target_that_stays_away_is_followed_when_joints_had_the_time() -> None:
    guard = started()
    course = [bool(guard.passed(np.array([[1.0, 0.0]]), NOBODY, MEASURED)[1][0]) for _ in range(4)]
    assert course == [True, True, False, False]


def test_a_first_target_may_be_anywhere_and_without_one_the_joints_stay() -> None:
    guard = TargetGuard(1, LIMIT, 0.02)
    passed, why = guard.passed(np.array([[2.0, 2.0]]), EVERYBODY, MEASURED)
    assert passed.tolist() == [[2.0, 2.0]]
    assert not any(why)
    passed, why = guard.passed(np.array([[np.nan, 2.0]]), EVERYBODY, MEASURED)
    assert passed.tolist() == MEASURED.tolist()
    assert all(why)


def test_robots_are_held_one_by_one() -> None:
    guard, nobody = TargetGuard(2, LIMIT, 0.02), np.zeros(2, bool)
    guard.passed(np.zeros((2, 2)), ~nobody, np.zeros((2, 2)))
    passed, why = guard.passed(np.array([[0.1, 0.1], [np.nan, 0.1]]), nobody, np.zeros((2, 2)))
    assert why == ("", "its targets are not finite")
    assert passed.tolist() == [[0.1, 0.1], [0.0, 0.0]]


def test_a_refused_robot_holds_its_targets_however_good_the_new_ones_are() -> None:
    guard, nobody = TargetGuard(2, LIMIT, 0.02), np.zeros(2, bool)
    guard.passed(np.zeros((2, 2)), ~nobody, np.zeros((2, 2)))
    passed, why = guard.passed(np.full((2, 2), 0.1), nobody, np.zeros((2, 2)), {1: "its sensors are off"})
    assert passed.tolist() == [[0.1, 0.1], [0.0, 0.0]]
    assert why == ("", "its sensors are off")
