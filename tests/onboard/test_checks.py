"""Checks before a robot moves."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from still import Still

from iowbc.commands.robot import report_checks
from iowbc.errors import UsageError
from iowbc.onboard import messages
from iowbc.onboard.checks import LIMITS, BusSnapshot, CheckResult, checks
from iowbc.onboard.messages import Record


def heard(still: Still, change: Callable[[Record], None] = lambda state: None) -> BusSnapshot:
    states = []
    for _ in range(45):
        still.turns += 1
        states.append(still.state())
        change(states[-1])
    battery = messages.empty(messages.BATTERY_STATE)
    battery["soc"] = 80
    return BusSnapshot(states, 0.1, battery, 0, "")


def failed(still: Still, listened: BusSnapshot) -> list[str]:
    return [
        check.name for check in checks(still.controller, listened, "free", still.standing, LIMITS) if not check.passed
    ]


def test_a_robot_in_order_passes_every_check(still: Still) -> None:
    assert failed(still, heard(still)) == []


@pytest.mark.parametrize(
    ("other", "name"),
    [
        ({"states": []}, "states"),
        ({"seconds": 0.5}, "states"),
        ({"others": 3}, "publishers"),
        ({"mode": "ai"}, "mode"),
        ({"mode": None}, "mode"),
        ({"battery": None}, "battery"),
    ],
)
def test_what_the_bus_carried_is_checked(still: Still, other: dict[str, Any], name: str) -> None:
    assert failed(still, replace(heard(still), **other)) == [name]


@pytest.mark.parametrize("apart", [0, 5000])
def test_the_states_of_two_robots_are_refused(still: Still, apart: int) -> None:
    listened = heard(still)
    other = [state.copy() for state in listened.states]
    for state in other:
        state["tick"] += apart
        state["imu_state"]["gyroscope"] += 0.1
    mixed = [state for pair in zip(listened.states, other, strict=True) for state in pair]
    assert failed(still, replace(listened, states=mixed)) == ["states"]


def test_a_low_battery_is_refused(still: Still) -> None:
    listened = heard(still)
    assert listened.battery is not None
    listened.battery["soc"] = 10
    assert failed(still, listened) == ["battery"]


@pytest.mark.parametrize(("field", "value", "name"), [("mode_machine", 2, "model"), ("mode_pr", 1, "ankles")])
def test_another_model_is_refused(still: Still, field: str, value: int, name: str) -> None:
    def change(state: Record) -> None:
        state[field] = value

    assert failed(still, heard(still, change)) == [name]


def test_a_hot_motor_is_refused(still: Still) -> None:
    def change(state: Record) -> None:
        state["motor_state"]["temperature"][7] = 95

    assert failed(still, heard(still, change)) == ["temperature"]


def test_a_joint_beyond_its_limit_is_refused(still: Still) -> None:
    still.posture = still.posture.copy()
    still.posture[3] = -0.4
    assert "joints" in failed(still, heard(still))


def test_the_dry_run_names_the_joint_whose_target_is_furthest_in_any_step(
    still: Still, monkeypatch: pytest.MonkeyPatch
) -> None:
    contract = still.controller.contract
    targets = itertools.chain([(7, 2.0)], itertools.repeat((3, 0.5)))

    def step(*given: Any, **named: Any) -> SimpleNamespace:
        joint, away = next(targets)
        position = np.array([contract.default_position])
        position[0, joint] += away
        return SimpleNamespace(position=position, held=[False])

    monkeypatch.setattr(still.controller, "step", step)
    found = checks(still.controller, heard(still), "free", still.standing, LIMITS)[-1]
    assert found.text == f"targets at most 2.00 rad from the default posture ({contract.joints[7]})"


def test_the_verdicts_are_seen_in_a_narrow_terminal_and_a_waived_failure_passes(
    capsys: pytest.CaptureFixture[str],
) -> None:
    long = "targets at most 0.70 rad from the default posture (right_shoulder_pitch_joint), and more"
    found = [CheckResult("states", False, "218 a second"), CheckResult("policy", True, long)]
    with pytest.raises(UsageError, match="states: failed"):
        report_checks(Console(width=60), found, ())
    assert "states FAILED 218 a second" in " ".join(capsys.readouterr().out.split())
    report_checks(Console(width=60), found, ("states",))
    assert "states waived 218 a second" in " ".join(capsys.readouterr().out.split())


def test_silence_and_a_robot_with_other_motors_cannot_be_waived(still: Still, monkeypatch: pytest.MonkeyPatch) -> None:
    listened = heard(still)
    silent = checks(still.controller, replace(listened, states=[]), "free", still.standing, LIMITS)
    joints = still.controller.contract.joints[::-1]
    monkeypatch.setattr(still.controller, "contract", still.controller.contract.model_copy(update={"joints": joints}))
    other = checks(still.controller, listened, "free", still.standing, LIMITS)
    for found, name in ((silent, "states"), (other, "model")):
        with pytest.raises(UsageError, match=rf"^{name}: failed, no motor command was sent; put it right$"):
            report_checks(Console(width=60), found, (name, "battery"))
