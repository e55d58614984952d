"""Processes and participants on the loopback: a golden rollout, and what a killed process does to the other."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from exported_policies import read_golden
from scripted import simulated
from still import Still

from iowbc.control.sensors import Measured
from iowbc.deploy.controller import Controller
from iowbc.onboard import messages, process
from iowbc.onboard.machine import OperatorRequest, State
from iowbc.onboard.messages import Record
from iowbc.onboard.process import LockStep, drive
from iowbc.onboard.sensors import Sensors
from iowbc.twin.robot import low_state

pytest.importorskip("cyclonedds")
pytest.importorskip("mcap")
from iowbc.onboard.dds import DdsBus, _mode_name
from iowbc.onboard.errors_of_run import read_run
from iowbc.onboard.log import LogWriter, export_digest, read_cycles, read_states, replay

pytestmark = pytest.mark.integration
STEPS = 100
"""Control steps of the golden rollout that go over the bus."""


@pytest.fixture
def domain() -> int:
    """A DDS domain of this test process alone."""
    return 100 + os.getpid() % 100


@pytest.fixture
def ends(domain: int) -> Iterator[tuple[DdsBus, DdsBus]]:
    """Two participants of one bus."""
    robot, program = DdsBus("lo", domain), DdsBus("lo", domain)
    yield robot, program
    for bus in (robot, program):
        bus.close()


def connect(sender: DdsBus, receiver: DdsBus, kind: np.dtype[np.void]) -> None:
    """Returns when the receiver hears the sender and no message sent for this is left on the way."""
    receiver.take(kind)
    message = messages.empty(kind)
    sender.publish(message)
    while not receiver.wait(kind, 0.1):
        sender.publish(message)
    message["reserve"] = 1
    sender.publish(message)
    while not any(arrived["reserve"].any() for arrived in receiver.take(kind)):
        receiver.wait(kind, 0.1)


def test_messages_cross_and_nobody_receives_its_own(ends: tuple[DdsBus, DdsBus]) -> None:
    robot, program = ends
    program.take(messages.LOW_COMMAND)
    connect(program, robot, messages.LOW_COMMAND)
    command = messages.empty(messages.LOW_COMMAND)
    command["motor_cmd"]["q"][3] = 0.25
    program.publish(command)
    robot.wait(messages.LOW_COMMAND, 10.0)
    (arrived,) = robot.take(messages.LOW_COMMAND)
    assert arrived.tobytes() == command.tobytes()
    assert program.take(messages.LOW_COMMAND) == []


def test_the_motion_switcher_answers_that_no_controller_is_active(ends: tuple[DdsBus, DdsBus]) -> None:
    robot, program = ends
    over = threading.Event()
    robot.answer_mode_requests()  # its topics, which two threads cannot make at the same time

    def answer() -> None:
        while not over.wait(0.02):
            robot.answer_mode_requests()

    answering = threading.Thread(target=answer)
    answering.start()
    try:
        assert program.high_level_mode(10.0) == ""
    finally:
        over.set()
        answering.join()


@pytest.mark.parametrize(
    ("code", "data", "name"),
    [
        (0, '{"name": ""}', ""),
        (0, '{"name": "ai"}', "ai"),
        (7301, '{"name": ""}', None),
        (0, "{}", None),
        (0, "", None),
    ],
)
def test_an_answer_of_the_motion_switcher_without_a_name_or_with_an_error_is_none(
    code: int, data: str, name: str | None
) -> None:
    header = SimpleNamespace(status=SimpleNamespace(code=code))
    assert _mode_name(SimpleNamespace(header=header, data=data)) == name


class Rollout:
    """The robot of a golden rollout: stands in its first posture until the policy runs, then moves as it did."""

    def __init__(self, still: Still, folder: Path) -> None:
        self.machine, self.standing = still.machine, still.standing
        self.inputs, self.outputs = read_golden(folder / "golden.npz")
        self.states = [self._state(step) for step in range(STEPS)]
        self.run = 0
        """Turns of the loop in Run."""
        self.turns = 0

    def _state(self, step: int) -> Record:
        names = ("projected_gravity", "base_angular_velocity", "heading", "joint_position", "joint_velocity")
        seen = Measured(**{name: self.inputs[name][step : step + 1].astype(np.float64) for name in names})
        return low_state(0, seen, np.zeros(29))

    @property
    def ended(self) -> bool:
        return self.run >= 10 * STEPS or self.turns >= 5000

    @staticmethod
    def _step(turn: int) -> int:
        return min(turn // 10, STEPS - 1)

    def state(self) -> Record:
        """The state of the next turn; its time and its temperatures make it new."""
        self.turns += 1
        state = self.states[self._step(self.run + 1)].copy()
        state["tick"] = 2 * self.turns
        for part in ("imu_state", "motor_state"):
            state[part]["temperature"] = self.turns % 70
        return state

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        order = {State.ZERO_TORQUE: State.DAMPING, State.DAMPING: State.STAND, State.STAND: State.RUN}
        request = order.get(self.machine.state) if self.run == 0 and self.turns % 60 == 0 else None
        if self.machine.state is State.RUN:
            self.run += 1
        command = self.inputs["command"][self._step(self.run)].astype(np.float64)
        return OperatorRequest(command, now, request)


def test_a_golden_rollout_over_the_bus_equals_the_one_without(
    ends: tuple[DdsBus, DdsBus], still: Still, blind: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, program = ends
    monkeypatch.setattr(process, "PATIENCE", 60.0)  # no cycle without a state, however slow this machine is
    connect(robot, program, messages.LOW_STATE)
    connect(program, robot, messages.LOW_COMMAND)
    rollout, targets = Rollout(still, blind), {}
    about = {"export": export_digest(still.controller), "scene": "free", "recipe": "blind"}
    about["limits"] = still.machine.limits.model_dump_json()
    with LogWriter(tmp_path / "log.mcap", about) as log:
        loop = threading.Thread(
            target=drive,
            args=(program, still.machine, rollout, LockStep()),
            kwargs={"log": log, "tell": lambda _: None, "stopped": lambda: rollout.ended},
        )
        loop.start()
        while loop.is_alive():
            robot.publish(rollout.state())
            robot.wait(messages.LOW_COMMAND, 1.0 if rollout.ended else 30.0)
            for command in robot.take(messages.LOW_COMMAND):
                targets[rollout.run] = command["motor_cmd"]["q"][:29]
    offline, sensors = Controller.load(blind), Sensors(29)
    offline.reset(scene="free")
    expected = []
    for step, state in enumerate(rollout.states):
        state["tick"] = step + 1
        sensors.take((state,), 0.02 * step)
        command = rollout.inputs["command"][step].astype(np.float64)
        expected.append(offline.step(sensors.measured, command).position[0].astype(np.float32))
    over_the_bus = [targets[10 * step] for step in range(1, STEPS)]
    np.testing.assert_array_equal(over_the_bus, expected[1:])
    # The golden measurements have noise in the length of gravity, which no orientation can tell.
    assert np.abs(np.array(expected) - rollout.outputs["target"][:STEPS]).max() < 0.1

    turns, different = replay(tmp_path / "log.mcap", blind)
    assert (different, turns) == (0, len(list(read_cycles(tmp_path / "log.mcap"))))
    whole = (tmp_path / "log.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    cycles, different = replay(tmp_path / "cut.mcap", blind)
    assert different == 0 < cycles < turns
    begin = next(read_cycles(tmp_path / "log.mcap"))[0].now
    entered = {state: time - begin for time, state in read_states(tmp_path / "log.mcap")}
    run = read_run(tmp_path / "log.mcap", offline.robot, 50.0, 1.5)
    assert entered[State.STAND] < entered[State.RUN] <= run.time[0] + 1e-6


def test_a_program_whose_robot_is_killed_damps_and_ends(blind: Path, domain: int) -> None:
    with simulated(blind, "--lockstep", domain=domain) as robot:
        options = ("--domain", str(domain), "--lockstep", "--commands", "udp:0")
        program = subprocess.Popen(
            [sys.executable, "-m", "iowbc", "robot", str(blind), *options], stdout=subprocess.PIPE, text=True
        )
        assert program.stdout is not None
        for line in program.stdout:
            if "zero torque" in line:
                break
        robot.kill()
        robot.wait()
        program.send_signal(signal.SIGINT)
        rest = program.communicate(timeout=120)[0]
    assert "damping: requested" in rest
    assert program.returncode == 0
