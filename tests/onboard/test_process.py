"""The loop damps the robot however it ends, and neither a terminal nor a log can delay or end it."""

import errno
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from still import Still

from iowbc.errors import Damaged
from iowbc.onboard import messages
from iowbc.onboard.log import LogWriter, is_cut, read_cycles, read_messages, read_states
from iowbc.onboard.machine import OperatorRequest, State
from iowbc.onboard.messages import LOW_COMMAND, TOPICS, Record, to_cdr
from iowbc.onboard.process import FINAL_DAMPING, PERIOD, LockStep, drive, listen


class Bus:
    """A bus with a robot that stands, and the commands that it received."""

    def __init__(self, still: Still) -> None:
        self.still, self.commands = still, list[Record]()

    def publish(self, command: Record) -> None:
        self.commands.append(command)

    def wait(self, kind: Any, seconds: float) -> bool:
        self.still.turns += 1
        return True

    def take(self, kind: Any) -> list[Record]:
        return [self.still.state()] if "motor_state" in (kind.names or ()) else []


class Operator:
    """Runs the robot, and then fails."""

    def __init__(self, still: Still, fails_after: int) -> None:
        self.still, self.fails_after, self.turns = still, fails_after, 0

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        self.turns += 1
        if self.turns > self.fails_after:
            raise ValueError("no command")
        order = {1: State.DAMPING, 2: State.STAND, 80: State.RUN}
        return OperatorRequest(self.still.standing, now, order.get(self.turns))


def driven(still: Still, turns: int, **options: Any) -> Bus:
    bus: Any = Bus(still)
    with pytest.raises(ValueError, match="no command"):
        drive(bus, still.machine, Operator(still, turns), LockStep(), **options)
    return bus  # type: ignore[no-any-return]


def test_an_error_in_the_loop_damps_a_running_robot_before_it_ends(still: Still) -> None:
    commands = driven(still, 100, tell=lambda text: None).commands
    assert (commands[99]["motor_cmd"]["kp"][:29] > 0.0).all()
    assert len(commands) == 100 + round(FINAL_DAMPING / PERIOD)
    assert not any(command["motor_cmd"]["kp"].any() for command in commands[100:])
    assert (commands[-1]["motor_cmd"]["kd"][:29] > 0.0).all()


def test_a_terminal_that_is_gone_does_not_end_the_loop(still: Still) -> None:
    def gone(text: str) -> None:
        raise BrokenPipeError

    assert (driven(still, 100, tell=gone).commands[99]["motor_cmd"]["kp"][:29] > 0.0).all()


@pytest.mark.parametrize(
    ("ticks", "times"),
    [((1000, None, 0, 2), (1.0, 2.0, 2.0, 2.002)), ((1000, None, 1002, 1004), (1.0, 2.0, 2.002, 2.004))],
    ids=["restarts", "waits"],
)
def test_in_lock_step_time_goes_on_when_the_robot(ticks: tuple[int | None, ...], times: tuple[float, ...]) -> None:
    coming = iter(ticks)

    def take(kind: Any) -> list[Record]:
        state = messages.empty(messages.LOW_STATE)
        if (tick := next(coming)) is None:
            return []
        state["tick"] = tick
        return [state]

    bus: Any = SimpleNamespace(wait=lambda kind, seconds: True, take=take)
    clock = LockStep()
    assert [clock.turn(bus)[0] for _ in range(4)] == pytest.approx(times)


def test_a_battery_that_is_silent_after_the_checks_is_missed(still: Still) -> None:
    told: list[str] = []
    still.machine.limits = still.machine.limits.model_copy(update={"battery_age": 0.1})
    driven(still, 200, tell=told.append, charge=80.0)
    assert sum("warning: no battery message for 0 s, the last said 80 %" in line for line in told) == 1


def test_listening_ends_when_it_is_stopped() -> None:
    bus: Any = SimpleNamespace(wait=lambda kind, seconds: False)
    assert listen(bus, 3.0, lambda: True).states == []


def test_a_full_disk_ends_the_log_alone(still: Still, tmp_path: Path) -> None:
    told: list[str] = []
    with LogWriter(tmp_path / "log.mcap", {}) as log:

        def full(*_: Any) -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        log._writer = SimpleNamespace(add_message=full)  # type: ignore[assignment]
        commands = driven(still, 400, tell=told.append, log=log).commands
    assert (commands[399]["motor_cmd"]["kp"][:29] > 0.0).all()
    assert sum("log: No space left on device; nothing more is logged" in line for line in told) == 1
    assert np.isfinite(commands[-1]["motor_cmd"]["kd"]).all()


def test_a_log_that_cannot_be_finished_is_told_and_closed(tmp_path: Path) -> None:
    with LogWriter(tmp_path / "log.mcap", {}) as log:
        file = log._file

        def full() -> None:
            raise OSError(errno.ENOSPC, "No space left on device")

        log._writer.finish = full  # type: ignore[method-assign]
    assert log.failure == "No space left on device"
    assert file.closed


def test_a_log_of_another_version_is_refused(still: Still, tmp_path: Path) -> None:
    with LogWriter(tmp_path / "log.mcap", {}) as log:
        log.add("inputs", 0.0, command=[0.0] * 11, request="crawl")
        log.put((TOPICS[LOW_COMMAND], 0.0, to_cdr(still.turn())))
        log.add("event", 0.0, text="crawl", state="crawl")
    for read in (read_states, read_cycles):
        with pytest.raises(Damaged, match=r"log\.mcap: content .* may be of another version"):
            list(read(tmp_path / "log.mcap"))


def test_a_cut_log_is_known_and_a_damaged_one_refused(still: Still, tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    with LogWriter(path, {}) as log:
        driven(still, 20, log=log)
    whole, count = path.read_bytes(), len(list(read_messages(path)))
    assert not is_cut(path)
    path.write_bytes(whole[:-100])
    assert is_cut(path)
    assert len(list(read_messages(path))) == count
    middle = len(whole) // 2
    path.write_bytes(whole[:middle] + bytes([whole[middle] ^ 1]) + whole[middle + 1 :])
    with pytest.raises(Damaged, match=r"log\.mcap"):
        list(read_messages(path))
