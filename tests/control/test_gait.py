"""The gait clock."""

import numpy as np
import pytest

from iowbc.control import gait
from iowbc.control.sensors import Measured
from iowbc.recipe.task.joint_references import GaitPrior, Recovery

PRIOR = GaitPrior(frequency=1.0, stance=0.6)
DT = 0.02


def run(commands: list[bool], phase: float = 0.0) -> list[tuple[float, bool]]:
    """Phase and whether the clock runs, after each step with or without a command to move."""
    now, stepping = np.array([phase]), np.array([False])
    course = []
    for moving in commands:
        now, stepping = gait.advance(now, stepping, np.array([moving]), PRIOR, DT)
        course.append((float(now[0]), bool(stepping[0])))
    return course


def test_the_clock_runs_at_its_frequency_while_a_motion_is_commanded() -> None:
    course = run([True] * 100)
    assert [phase for phase, _ in course[:3]] == pytest.approx([0.02, 0.04, 0.06])
    assert course[-1][0] % 1.0 == pytest.approx(0.0, abs=1e-9)
    assert all(stepping for _, stepping in course)


def test_after_the_command_it_runs_on_to_the_next_double_support_and_rests_there() -> None:
    course = run([True] * 10 + [False] * 40)
    assert course[15] == (pytest.approx(0.32), True)
    assert course[-1] == (0.5, False)
    assert course[30] == (0.5, False)


def test_it_rests_until_it_is_told_to_move() -> None:
    assert run([False] * 5, phase=0.5) == [(0.5, False)] * 5


def test_the_feet_swing_in_turn_and_both_stand_in_between() -> None:
    phases = np.linspace(0.0, 1.0, 200, endpoint=False)
    stance = gait.expected_stance(gait.foot_phase(phases), np.ones(200, bool), 0.6)
    assert stance.mean(axis=0) == pytest.approx([0.6, 0.6], abs=0.01)
    assert stance.any(axis=1).all()
    assert stance.all(axis=1).mean() == pytest.approx(0.2, abs=0.02)
    assert gait.expected_stance(gait.foot_phase(phases), np.zeros(200, bool), 0.6).all()


def test_soles_swing_along_a_half_wave() -> None:
    progress = gait.swing_progress(np.array([[0.3, 0.6], [0.8, 0.7]]), PRIOR.stance)
    height = gait.swing_height(progress, PRIOR)
    assert height == pytest.approx(np.array([[0.0, 0.0], [0.08, 0.08 * np.sin(np.pi / 4)]]), abs=1e-12)


def test_a_profile_at_rest_lifts_off_and_lands_without_speed() -> None:
    phase = np.linspace(0.0, 1.0, 10_001)[:-1, None]
    progress = gait.swing_progress(phase, PRIOR.stance)
    rest = gait.swing_height(progress, GaitPrior(profile="rest"))[:, 0]
    sine = gait.swing_height(progress, GaitPrior())[:, 0]
    assert rest.max() == pytest.approx(sine.max()) == pytest.approx(0.08)
    speed = np.abs(np.diff(rest)) / np.diff(phase[:, 0])
    assert speed[[5800, 5801, -1]] == pytest.approx(0.0, abs=0.01), "the sine has 0.6 m a stride"


def test_the_phase_signal_is_on_the_circle_or_zero_at_rest() -> None:
    signal = gait.phase_signal(np.array([0.25, 0.25]), np.array([True, False]))
    assert signal[0] == pytest.approx([1.0, 0.0], abs=1e-12)
    assert signal[1].tolist() == [0.0, 0.0]


def test_small_commands_ask_for_no_steps() -> None:
    command = np.zeros((3, 11))
    command[1, 0], command[2, 2] = 0.3, -0.3
    assert gait.wants_to_move(command, PRIOR).tolist() == [False, True, True]


def sensed(pitch: float, roll: float, rate: tuple[float, float, float]) -> Measured:
    """Of one robot that leans forward and to the right [rad], turning at a rate [rad/s]."""
    gravity = np.array([[np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)]])
    joints = np.zeros((1, 29))
    return Measured(gravity, np.array([rate]), np.zeros((1, 1)), joints, joints)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_standing_robot_steps_when_it_tips_over_and_not_when_it_bows(side: float) -> None:
    recovery, bowed = Recovery(tilt=0.1, horizon=0.25), np.array([0.4])
    assert not gait.is_falling(sensed(0.4, 0.0, (0.0, 0.0, 0.0)), bowed, recovery)
    assert gait.is_falling(sensed(0.4 + side * 0.13, 0.0, (0.0, 0.0, 0.0)), bowed, recovery)
    assert gait.is_falling(sensed(0.4, side * 0.11, (0.0, 0.0, 0.0)), bowed, recovery)
    assert gait.is_falling(sensed(0.4, 0.0, (side * 0.5, 0.0, 0.0)), bowed, recovery)
    assert not gait.is_falling(sensed(0.4, side * 0.11, (-side * 0.5, 0.0, 0.0)), bowed, recovery)
