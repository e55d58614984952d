"""The state machine: order of states, gains, and what leads to damping."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from still import Still

from iowbc.control.command import COMMAND, HEIGHT, PITCH
from iowbc.deploy.controller import Controller
from iowbc.onboard.machine import State
from iowbc.onboard.messages import Record
from iowbc.onboard.process import PERIOD
from iowbc.onboard.ranges import Ranges


def gains(command: Record) -> tuple[float, float]:
    """Largest position and velocity gain."""
    motors = command["motor_cmd"][:29]
    return float(motors["kp"].max()), float(motors["kd"].min())


def test_a_robot_begins_without_torque(still: Still) -> None:
    command = still.turn()
    assert still.machine.state is State.ZERO_TORQUE
    assert gains(command) == (0.0, 0.0)
    assert (command["motor_cmd"]["mode"][:29] == 1).all()


def test_states_are_entered_in_order_alone(still: Still) -> None:
    for wanted in (State.RUN, State.STAND):
        still.turn(wanted)
        assert still.machine.state is State.ZERO_TORQUE
        assert f"{wanted} refused" in still.machine.events[0]
    still.turn(State.DAMPING)
    still.turn(State.STAND)
    still.turn(State.RUN)
    assert still.machine.state is State.STAND
    assert "not reached yet" in still.machine.events[0]


def test_stand_raises_gains_and_moves_to_the_posture_of_the_command(still: Still) -> None:
    still.posture = still.posture + 0.2
    still.turn(State.DAMPING)
    first = still.turn(State.STAND)
    assert gains(first)[0] == 0.0
    halfway = [still.turn() for _ in range(25)][-1]
    assert gains(halfway)[0] == pytest.approx(0.5 * max(still.controller.contract.kp), rel=0.01)
    last = [still.turn() for _ in range(30)][-1]
    np.testing.assert_allclose(last["motor_cmd"]["q"][:29], still.posture - 0.2, atol=1e-4)


def test_run_is_refused_far_from_the_standing_posture(still: Still) -> None:
    still.until(State.STAND)
    still.posture = still.posture + 0.35
    still.turn()
    still.turn(State.RUN)
    assert still.machine.state is State.STAND
    assert "from the standing posture" in still.machine.events[0]


def test_the_policy_moves_the_targets_at_its_own_rate(still: Still) -> None:
    still.until(State.RUN)
    targets = [still.turn()["motor_cmd"]["q"][:29].copy() for _ in range(40)]
    changed = [not np.array_equal(one, other) for one, other in itertools.pairwise(targets)]
    assert np.diff(np.flatnonzero(changed)).tolist() == [10, 10, 10]


@pytest.mark.parametrize("state", [State.DAMPING, State.STAND, State.RUN])
def test_damping_is_entered_from_everywhere_at_once(still: Still, state: State) -> None:
    still.until(state)
    assert gains(still.turn(State.DAMPING)) == (0.0, min(still.controller.contract.kd))


def broken(still: Still, name: str, value: float) -> tuple[Record, ...]:
    state = still.state()
    if name == "quaternion":
        state["imu_state"]["quaternion"] = np.cos(value / 2), np.sin(value / 2), 0.0, 0.0
    else:
        state["motor_state"][name][3] = value
    return (state,)


@pytest.mark.parametrize("state", [State.STAND, State.RUN])
@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("q", np.nan, "not finite"),
        ("q", np.inf, "not finite"),
        ("q", -0.3, "position limit: left_knee_joint"),
        ("dq", 21.0, "velocity limit: left_knee_joint"),
        ("tau_est", -170.0, "torque limit: left_knee_joint"),
        ("quaternion", 1.1, "tilt"),
        ("temperature", 101, "temperature: left_knee_joint at 101 °C"),
        ("quaternion", np.nan, "not finite"),
    ],
)
def test_a_measurement_beyond_its_limit_damps_in_the_same_turn(
    still: Still, state: State, name: str, value: float, reason: str
) -> None:
    still.until(state)
    still.turns += 1
    states = broken(still, name, value)
    still.turns -= 1
    command = still.turn(states=states)
    assert still.machine.state is State.DAMPING
    assert reason in still.machine.events[0]
    assert gains(command)[0] == 0.0


def test_states_that_stay_away_damp_within_20_ms(still: Still) -> None:
    still.until(State.RUN)
    last = still.now
    while still.machine.state is State.RUN:
        still.turn(states=())
    assert "stale state" in still.machine.events[0]
    assert still.now - last <= 0.020


def test_states_that_repeat_damp_within_20_ms(still: Still) -> None:
    still.until(State.RUN)
    last, state = still.now, still.state()
    while still.machine.state is State.RUN:
        still.turn(states=(state,))
    assert still.now - last <= 0.020


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        ({"others": 1}, "second publisher"),
        ({"late": 0.012}, "loop overrun"),
        ({"at": 0.0}, "stale command"),
        ({"charge": 9.0}, "battery at 9 %, less than 10"),
    ],
)
@pytest.mark.parametrize("state", [State.STAND, State.RUN])
def test_what_else_goes_wrong_damps_a_robot_that_stands_or_runs(
    still: Still, state: State, other: dict[str, float], reason: str
) -> None:
    still.until(state)
    still.turn(**other)
    assert still.machine.state is State.DAMPING
    assert reason in still.machine.events[0]


def test_a_low_battery_is_warned_of_once_and_damps_when_it_is_empty(still: Still) -> None:
    still.until(State.RUN)
    told = []
    for charge in (20.0, 19.0, 18.0, 10.0):
        still.turn(charge=charge)
        told += still.machine.events
        still.turn()
        assert (still.machine.state, still.machine.events) == (State.RUN, [])
    assert told == ["warning: battery at 19 %, less than 20"]
    still.turn(charge=9.0)
    assert still.machine.state is State.DAMPING
    still.turn(State.STAND)
    assert "stand refused: battery at 9 %" in still.machine.events[0]


def test_a_battery_whose_messages_stop_is_warned_of_once(still: Still) -> None:
    still.until(State.RUN)
    still.turn(charge=50.0)
    limit = round(still.machine.limits.battery_age / PERIOD)
    told = []
    for _ in range(limit + 10):
        still.turn()
        told += still.machine.events
    assert told == ["warning: no battery message for 10 s, the last said 50 %"]
    assert still.machine.state is State.RUN
    still.turn(State.DAMPING)
    still.turn(State.STAND)
    assert "warning: no battery message for 10 s, the last said 50 %" in still.machine.events


def test_a_battery_that_never_sent_a_message_is_not_missed(still: Still) -> None:
    still.until(State.RUN)
    for _ in range(round(still.machine.limits.battery_age / PERIOD) + 10):
        still.turn()
        assert still.machine.events == []


def test_a_warm_motor_is_warned_of_once_after_each_stand(still: Still) -> None:
    def warm() -> tuple[str, ...]:
        still.turns += 1
        states = broken(still, "temperature", 90)
        still.turns -= 1
        still.turn(states=states)
        return tuple(still.machine.events)

    for _ in range(2):
        still.until(State.RUN)
        assert warm() == ("warning: temperature: left_knee_joint at 90 °C, above 80",)
        assert warm() == ()
        still.turn(State.DAMPING)


def test_a_damped_robot_runs_again_by_way_of_stand(still: Still) -> None:
    still.until(State.RUN)
    still.turn(others=1)
    still.turn(State.STAND)
    assert still.machine.events == ["stand refused: second publisher: another program sends low-level commands"]
    for _ in range(round(still.machine.limits.command_age / PERIOD)):
        still.turn()
    still.until(State.RUN)
    assert still.machine.state is State.RUN


def test_run_begins_where_stand_ends_whatever_is_commanded_by_then(still: Still) -> None:
    still.until(State.STAND)
    before_height, still.standing = still.standing[HEIGHT], still.standing.copy()
    still.standing[[0, HEIGHT, PITCH]] = 0.6, 0.5, 0.9
    before, legs = still.turn(), slice(0, 12)
    first = still.turn(State.RUN)
    assert still.machine.state is State.RUN
    moved = np.abs(first["motor_cmd"]["q"] - before["motor_cmd"]["q"])[legs]
    assert moved.max() < 0.3
    assert still.controller.state["command"][0, HEIGHT] == pytest.approx(before_height)
    for _ in range(round(0.1 / PERIOD)):
        still.turn()
    command = still.controller.state["command"][0]
    assert 0.0 < command[0] < 0.2
    assert 0.5 < command[HEIGHT] < before_height


def test_a_slow_loop_keeps_the_rate_of_the_policy_or_damps(still: Still) -> None:
    still.until(State.RUN)
    steps, begin = set(), still.now
    for _ in range(60):
        still.turns += 3  # turns of 8 ms
        still.turn()
        steps.add(still.controller.state["phase"].tobytes() + still.controller.state["history"].tobytes())
    assert still.machine.state is State.RUN, still.machine.events
    assert len(steps) == pytest.approx((still.now - begin) * still.controller.frequency, abs=2)


def test_a_robot_that_restarts_is_followed_again_and_one_wrong_tick_is_forgotten(still: Still) -> None:
    still.until(State.RUN)
    still.turns += 1
    later = still.state()
    later["tick"] = 4_000_000_000
    still.turn(states=(later,))
    for _ in range(round(0.02 / PERIOD)):
        still.turn()
    assert still.machine.state is State.DAMPING
    still.turns += round(1.0 / PERIOD)
    for _ in range(10):
        still.turn()
    still.until(State.RUN)
    assert still.machine.state is State.RUN


def test_states_of_a_second_robot_damp(still: Still) -> None:
    still.until(State.RUN)
    own, other = still.state(), still.state()
    other["tick"] -= 500
    still.turn(states=(own, other))
    assert still.machine.events[0].startswith("damping: states of two robots")
    still.turn(State.STAND)
    assert "stand refused: states of two robots" in still.machine.events[0]


def test_the_heading_counts_from_the_first_that_is_a_number(still: Still) -> None:
    state = still.state()
    state["imu_state"]["quaternion"] = 0.0
    still.turn(states=(state,))
    still.until(State.RUN)
    assert still.machine.sensors.heading == 0.0


def test_a_policy_that_observes_the_object_does_not_run_without_its_pose(sighted: Path) -> None:
    still = Still(Controller.load(sighted))
    still.until(State.STAND)
    still.turn(State.RUN)
    assert "no object pose" in still.machine.events[0]
    still.seen = {
        "object_position": np.zeros((1, 3)),
        "object_quaternion": np.array([[1.0, 0.0, 0.0, 0.0]]),
        "object_linear_velocity": np.zeros((1, 3)),
        "object_angular_velocity": np.zeros((1, 3)),
    }
    still.turn(State.RUN)
    assert still.machine.state is State.RUN


def test_the_heading_goes_on_past_half_a_turn(still: Still) -> None:
    for turn in range(1, 9):
        state = still.state()
        state["tick"], yaw = turn, 0.5 * turn
        state["imu_state"]["quaternion"] = np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)
        still.turn(states=(state,))
    assert still.machine.sensors.heading == pytest.approx(4.0, abs=1e-5)


@pytest.mark.parametrize("state", [State.STAND, State.RUN])
def test_a_command_that_is_not_finite_damps_and_is_refused(still: Still, state: State) -> None:
    still.until(state)
    still.standing = np.where(np.arange(len(COMMAND)) == HEIGHT, np.nan, still.standing)
    still.turn()
    assert still.machine.state is State.DAMPING
    assert "the command is not finite" in still.machine.events[0]
    still.turn(State.STAND)
    assert still.machine.state is State.DAMPING


def test_commands_beyond_the_ranges_of_training_are_clipped(still: Still) -> None:
    still.standing[HEIGHT] = 5.0
    goal = still.until(State.STAND)["motor_cmd"]["q"][: len(still.posture)]
    clipped = Ranges(still.controller.contract).clipped(still.standing)
    assert goal == pytest.approx(still.controller.settled_posture(clipped)[0], abs=1e-6)
