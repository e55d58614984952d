"""Commands of the remote and of UDP."""

import contextlib
import json
import os
import socket
import struct
import sys
import tty
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from iowbc.control.command import HEIGHT, OFFSET, PITCH, YAW_RATE
from iowbc.deploy.contract import read_contract
from iowbc.errors import UsageError
from iowbc.onboard import messages
from iowbc.onboard.machine import State
from iowbc.onboard.messages import Record
from iowbc.onboard.operators import (
    BUTTONS,
    UNATTENDED,
    Keyboard,
    OperatorWithPoses,
    Remote,
    Udp,
    operator,
    udp_port,
)
from iowbc.onboard.ranges import Ranges


@pytest.fixture
def ranges(blind: Path) -> Ranges:
    return Ranges(read_contract(blind))


def remote(*pressed: str, left: tuple[float, float] = (0.0, 0.0), right: float = 0.0) -> Record:
    state = messages.empty(messages.LOW_STATE)
    bits = sum(1 << BUTTONS.index(name) for name in pressed)
    data = struct.pack("<2xHfffff16x", bits, left[0], right, 0.0, 0.0, left[1])
    state["wireless_remote"] = np.frombuffer(data, np.uint8)
    return state


def test_sticks_command_the_velocities_of_training(ranges: Ranges) -> None:
    source = Remote(ranges)
    full = source.wanted(0.0, remote(left=(0.0, 1.0), right=-1.0)).command
    assert full[0] == ranges.velocity[1, 0]
    assert full[YAW_RATE] == ranges.velocity[1, 2]
    back = source.wanted(0.0, remote(left=(1.0, -1.0))).command
    assert (back[0], back[1]) == (ranges.velocity[0, 0], ranges.velocity[0, 1])
    assert not source.wanted(0.0, remote(left=(0.05, 0.05))).command[:3].any()


def test_arrows_move_height_and_pitch_at_their_rates(ranges: Ranges) -> None:
    source, before = Remote(ranges), ranges.standing
    for turn in range(51):
        command = source.wanted(0.02 * turn, remote("down", "right")).command
    assert command[HEIGHT] == pytest.approx(before[HEIGHT] - 0.1)
    assert command[PITCH] == pytest.approx(before[PITCH] + 0.3)


def test_a_button_asks_once_and_damping_as_long_as_it_is_held(ranges: Ranges) -> None:
    source = Remote(ranges)
    assert [source.wanted(0.0, remote("A")).request for _ in range(3)] == [State.RUN, None, None]
    assert [source.wanted(0.0, remote("B", "A")).request for _ in range(2)] == [State.DAMPING, State.DAMPING]


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The far end of a terminal that is the standard input."""
    far, near = os.openpty()
    tty.setcbreak(near)
    with open(near, encoding="utf-8") as standard_input:
        monkeypatch.setattr(sys, "stdin", standard_input)
        yield far
        with contextlib.suppress(OSError):
            os.close(far)


F9, INSERT, DELETE, F1, CTRL_RIGHT = b"\x1b[20~", b"\x1b[2~", b"\x1b[3~", b"\x1bOP", b"\x1b[1;5C"


def pressed(keyboard: Keyboard, terminal: int, keys: bytes, now: float = 0.0) -> State | None:
    os.write(terminal, keys)
    return keyboard.wanted(now, None).request


def test_keys_command_and_function_keys_mean_nothing(ranges: Ranges, terminal: int) -> None:
    keyboard = Keyboard(ranges)
    assert [pressed(keyboard, terminal, key) for key in (F9, INSERT, DELETE, F1, CTRL_RIGHT)] == [None] * 5
    assert pressed(keyboard, terminal, b"i") is None
    assert keyboard.wanted(0.1, None).command[0] == pytest.approx(0.1)
    assert pressed(keyboard, terminal, b"2") is State.STAND
    assert pressed(keyboard, terminal, F9 + b"3") is State.RUN


def test_escape_damps_and_a_sequence_that_is_cut_requests_nothing_else(ranges: Ranges, terminal: int) -> None:
    keyboard = Keyboard(ranges)
    assert pressed(keyboard, terminal, b"\x1b") is State.DAMPING
    assert pressed(keyboard, terminal, b"[2~") is None
    assert pressed(keyboard, terminal, b"\x1b[") is None
    assert pressed(keyboard, terminal, b" ") is State.DAMPING
    assert pressed(keyboard, terminal, b"3") is State.RUN


def test_escape_damps_whatever_key_comes_with_it(ranges: Ranges, terminal: int) -> None:
    keyboard = Keyboard(ranges)
    for keys in (b"\x1b2", b"\x1b3", b"\x1bx", b"3\x1bi"):
        assert pressed(keyboard, terminal, keys) is State.DAMPING


def test_a_key_after_the_beginning_of_a_sequence_counts_again_after_half_a_second(
    ranges: Ranges, terminal: int
) -> None:
    keyboard = Keyboard(ranges)
    assert pressed(keyboard, terminal, b"\x1b[", now=1.0) is None
    assert pressed(keyboard, terminal, b"1", now=1.6) is State.DAMPING


def test_an_unattended_keyboard_stops_and_a_terminal_that_is_gone_damps(ranges: Ranges, terminal: int) -> None:
    keyboard = Keyboard(ranges)
    pressed(keyboard, terminal, b"ii", now=1.0)
    assert keyboard.wanted(1.0 + UNATTENDED, None).command[0] > 0.0
    assert not keyboard.wanted(1.1 + UNATTENDED, None).command[:HEIGHT].any()
    os.close(terminal)
    assert keyboard.wanted(2.0, None).request is State.DAMPING


@pytest.mark.parametrize("key", [b" ", b"0", b"1", b"2"])
def test_a_request_that_ends_walking_ends_the_commanded_velocity(ranges: Ranges, terminal: int, key: bytes) -> None:
    keyboard = Keyboard(ranges)
    pressed(keyboard, terminal, b"iiu")
    assert keyboard.wanted(0.1, None).command[:HEIGHT].any()
    pressed(keyboard, terminal, key)
    assert not keyboard.wanted(0.2, None).command[:HEIGHT].any()


def test_a_measurement_of_another_size_is_ignored(sighted: Path) -> None:
    source = Udp(Ranges(read_contract(sighted)), 0)
    send(source, json.dumps({"seen": {"object_position": [0.3, 0.0], "object_quaternion": [1, 0, 0, 0]}}).encode())
    assert source.wanted(0.0, None).seen.keys() == {"object_quaternion"}
    source.close()


@pytest.fixture
def source(ranges: Ranges) -> Iterator[Udp]:
    made = Udp(ranges, 0)
    yield made
    made.close()


def send(source: Udp, *datagrams: bytes) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for data in datagrams:
            sender.sendto(data, ("127.0.0.1", source.port))


def test_datagrams_are_clipped_to_training_and_keep_their_time(ranges: Ranges, source: Udp) -> None:
    send(source, json.dumps({"velocity": [9.0, 0.1], "height": 0.6, "request": "stand"}).encode())
    wanted = source.wanted(3.0, None)
    assert (wanted.command[0], wanted.command[HEIGHT], wanted.request) == (ranges.velocity[1, 0], 0.6, State.STAND)
    later = source.wanted(4.0, None)
    assert (later.at, later.request) == (3.0, None)


@pytest.mark.parametrize(
    "data", [b"", b"\xff", b"[1]", b'{"velocity": ["a", 1]}', b'{"speed": 1}', b'{"request": "fly"}', b"[" * 8000]
)
def test_a_datagram_that_cannot_be_read_changes_nothing(source: Udp, data: bytes) -> None:
    send(source, b'{"velocity": [0.2, 0.0]}', data)
    assert source.wanted(1.0, None).command[0] == 0.2


def test_a_sender_without_a_pause_does_not_hold_up_the_loop(source: Udp) -> None:
    send(source, *(json.dumps({"velocity": [0.001 * number, 0.0]}).encode() for number in range(20)))
    found = [source.wanted(0.0, None).command[0] for _ in range(3)]
    assert found == pytest.approx([0.007, 0.015, 0.019])


def test_datagrams_from_before_the_robot_was_ready_are_dropped(source: Udp) -> None:
    send(source, *[b'{"velocity": [0.2, 0.0], "request": "run"}'] * 20)
    source.discard()
    wanted = source.wanted(0.0, None)
    assert (wanted.request, wanted.command[0], wanted.at) == (None, 0.0, -np.inf)


def test_damping_wins_over_requests_that_follow_it(source: Udp) -> None:
    send(source, b'{"request": "damping"}', b'{"request": "run"}')
    assert source.wanted(0.0, None).request is State.DAMPING


def test_a_repeated_request_counts_once(source: Udp) -> None:
    given = [b'{"request": "stand"}', b'{"request": "stand"}', b'{"seen": {}}', b'{"request": "stand"}', b"{}"]
    found = []
    for data in (*given, *given[:1], b'{"request": "damping"}', b'{"request": "damping"}'):
        send(source, data)
        found.append(source.wanted(0.0, None).request)
    stand, damping = State.STAND, State.DAMPING
    assert found == [stand, None, None, None, None, stand, damping, damping]


@pytest.mark.parametrize("data", [b'{"request": "damping", "velocity": [0.3]}', b'{"request": "damping", "yaw": 0}'])
def test_a_request_to_damp_counts_whatever_else_is_wrong(source: Udp, data: bytes) -> None:
    send(source, data)
    assert source.wanted(0.0, None).request is State.DAMPING


def test_a_pose_alone_is_no_command(sighted: Path, source: Udp) -> None:
    source.ranges = Ranges(read_contract(sighted))
    send(source, b'{"velocity": [0.2, 0.0]}')
    source.wanted(1.0, None)
    send(source, json.dumps({"seen": {"object_position": [0.3, 0.0, 0.1]}}).encode())
    wanted = source.wanted(2.0, None)
    assert (wanted.command[0], wanted.at, wanted.seen_at) == (0.2, 1.0, 2.0)


def test_object_poses_of_another_source_leave_the_command_alone(sighted: Path, source: Udp) -> None:
    ranges = source.ranges = Ranges(read_contract(sighted))
    both = OperatorWithPoses(Remote(ranges), source)
    pose = {"object_position": [0.3, 0.0, 0.1]}
    send(source, json.dumps({"velocity": [0.2, 0.0], "request": "run", "seen": pose}).encode())
    wanted = both.wanted(3.0, remote("X"))
    assert (wanted.command[0], wanted.request, wanted.seen_at) == (0.0, State.STAND, 3.0)
    assert wanted.seen["object_position"].tolist() == [pose["object_position"]]
    assert both.wanted(4.0, remote()).seen_at == 3.0


@pytest.mark.parametrize("kind", ["joystick", "udp", "udp:x", "udp:70000"])
def test_an_unknown_source_is_refused(blind: Path, kind: str) -> None:
    with pytest.raises(UsageError, match="valid: remote, keyboard, udp:PORT"):
        operator(kind, read_contract(blind))
    with pytest.raises(UsageError, match=f"--object-pose {kind}: valid: udp:PORT"):
        udp_port(kind, "--object-pose")


def test_a_walking_robot_bows_less_than_a_standing_one(ranges: Ranges, blind: Path) -> None:
    known = read_contract(blind).commands
    asked = ranges.standing.copy()
    asked[PITCH], asked[OFFSET] = 1.5, 0.2
    standing = ranges.clipped(asked)
    assert standing[PITCH] == known.deep_pitch[1]
    assert standing[OFFSET] == pytest.approx([*np.add(known.common_offset, known.single_offset)] * 2)
    asked[0] = 9.0
    walking = ranges.clipped(asked)
    assert walking[:5] == pytest.approx([known.velocity_x[1], 0, 0, known.nominal_height, known.pitch[1]])
