"""Sources of commands: the wireless remote, the keyboard, or JSON over UDP."""

import contextlib
import json
import os
import select
import socket
import struct
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from pydantic import Field

from iowbc.control.command import HEIGHT, OFFSET, PITCH, YAW_RATE
from iowbc.deploy.contract import Contract
from iowbc.errors import UsageError
from iowbc.onboard.machine import OperatorRequest, State
from iowbc.onboard.messages import Record
from iowbc.onboard.ranges import Ranges
from iowbc.recipe.section import Section

BUTTONS = ("R1", "L1", "start", "select", "R2", "L2", "F1", "F2", "A", "B", "X", "Y", "up", "right", "down", "left")
"""Bits of the remote's buttons."""
REQUESTS = {"B": State.DAMPING, "select": State.ZERO_TORQUE, "start": State.DAMPING, "X": State.STAND, "A": State.RUN}
"""State that each button requests; of several pressed at once, the first listed counts."""
DEAD = 0.1
"""Deadband of a stick, as a fraction of its travel."""
HEIGHT_RATE, PITCH_RATE = 0.1, 0.3
"""Rates at which the remote's arrows change height [m/s] and torso pitch [rad/s]."""
KEYS = {" ": State.DAMPING, "0": State.ZERO_TORQUE, "1": State.DAMPING, "2": State.STAND, "3": State.RUN}
STEPS = {"i": (0, 0.1), "k": (0, -0.1), "j": (1, 0.05), "l": (1, -0.05), "u": (YAW_RATE, 0.1), "o": (YAW_RATE, -0.1)}
STEPS |= {"r": (HEIGHT, 0.02), "f": (HEIGHT, -0.02), "t": (PITCH, 0.1), "g": (PITCH, -0.1)}
"""Index of a command entry and step of each key [m/s, rad/s, m, rad]."""
LARGEST_DATAGRAM = 8192
MOST_DATAGRAMS = 8
"""Datagrams read in a cycle of the control loop: 4,000 a second. A sender that is faster must not delay the loop."""
BACKLOG = 10_000
"""Datagrams that are discarded before the robot moves; the system's buffer holds fewer."""
UNATTENDED = 5.0
"""Longest time without a key for which the keyboard's velocity is kept [s]: a connection that froze sends none."""
ESCAPE = "\x1b"
SEQUENCE = 0.5
"""Longest time between the characters of an escape sequence [s]."""


class Operator(Protocol):
    """A source of commands."""

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        """Command and request at `now` [s]; `state`: the robot's newest state."""


class Remote:
    """The wireless remote, whose bytes come with the robot's state. Left stick: velocity; right stick: yaw rate;
    arrows: height and torso pitch. B or Start: damping; X: stand; A: run; Select: zero torque."""

    def __init__(self, ranges: Ranges) -> None:
        self._ranges, self._command, self._pressed, self._last = ranges, ranges.standing.copy(), 0, 0.0

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        if state is None:
            return OperatorRequest(self._command.copy(), now)
        data = state["wireless_remote"].tobytes()
        bits, left_x, right_x, _, _, left_y = struct.unpack_from("<2xHfffff", data)
        down = {name for place, name in enumerate(BUTTONS) if bits >> place & 1}
        fresh = {name for name in down if not self._pressed >> BUTTONS.index(name) & 1}
        self._pressed, passed = bits, min(max(now - self._last, 0.0), 0.1)
        self._last = now
        self._command[:HEIGHT] = [self._stick(i, value) for i, value in enumerate((left_y, -left_x, -right_x))]
        self._command[HEIGHT] += HEIGHT_RATE * passed * (("up" in down) - ("down" in down))
        self._command[PITCH] += PITCH_RATE * passed * (("right" in down) - ("left" in down))
        self._command = self._ranges.clipped(self._command)
        request = next((wanted for name, wanted in REQUESTS.items() if name in fresh), None)
        return OperatorRequest(self._command.copy(), now, State.DAMPING if "B" in down else request)

    def _stick(self, axis: int, value: float) -> float:
        if not abs(value) > DEAD:
            return 0.0
        low, high = self._ranges.velocity[:, axis]
        return float(min(abs(value), 1.0) * (high if value > 0.0 else low))


class Keyboard:
    """Keys of this terminal: 1 damping, 2 stand, 3 run, 0 zero torque, space damping; i k j l u o velocity, r f height,
    t g torso pitch, x stops. Escape damps, and so does a terminal that is gone. The velocity returns to zero on every
    request but run, and without a key for `UNATTENDED`."""

    def __init__(self, ranges: Ranges) -> None:
        self._ranges, self._command, self._pressed = ranges, ranges.standing.copy(), 0.0
        self._sequence = ""
        """The beginning of an escape sequence, as function keys send them; such keys mean nothing."""

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        request, keys = None, self._keys()
        if now - self._pressed > SEQUENCE:
            self._sequence = ""
        for key in keys or "":
            if self._sequence == ESCAPE and key not in "[O":
                request = State.DAMPING
            if not self._single(key):
                continue
            request = State.DAMPING if request is State.DAMPING else KEYS.get(key, request)
            if key in STEPS:
                place, step = STEPS[key]
                self._command[place] += step
            elif key == "x":
                self._command[:HEIGHT] = 0.0
        if keys is None or self._sequence == ESCAPE:
            request = State.DAMPING
        self._pressed = now if keys else self._pressed
        if now - self._pressed > UNATTENDED or request not in (None, State.RUN):
            self._command[:HEIGHT] = 0.0
        self._command = self._ranges.clipped(self._command)
        return OperatorRequest(self._command.copy(), now, request)

    def _keys(self) -> str | None:
        """Keys pressed since the last call; None if the terminal is gone."""
        try:
            if not select.select([sys.stdin], [], [], 0.0)[0]:
                return ""
            return os.read(sys.stdin.fileno(), LARGEST_DATAGRAM).decode("latin-1") or None
        except (OSError, ValueError):
            return None

    def _single(self, key: str) -> bool:
        """True for a key of its own, False for a character of an escape sequence, which a space or `@` to `~` ends."""
        begun, self._sequence = self._sequence, ""
        if key == ESCAPE or (begun == ESCAPE and key in "[O"):
            self._sequence = key if key == ESCAPE else begun + key
            return False
        inside = len(begun) > 1 and key != " "
        self._sequence = begun if inside and not "@" <= key <= "~" else ""
        return not inside


@contextlib.contextmanager
def single_keys() -> Iterator[None]:
    """Makes the terminal deliver single keys without Enter. Raises UsageError without a terminal."""
    import termios
    import tty

    if not sys.stdin.isatty():
        raise UsageError("--commands keyboard: the standard input is no terminal; use remote or udp")
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    try:
        yield
    finally:
        with contextlib.suppress(termios.error):  # the terminal may be gone
            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, before)


class Datagram(Section):
    """A command over UDP, as JSON."""

    velocity: tuple[float, float] = (0.0, 0.0)
    """Velocity forward and to the left [m/s]."""
    yaw_rate: float = 0.0
    """Yaw rate to the left [rad/s]."""
    height: float | None = None
    """Height of the pelvis [m]; by default that of training's nominal command."""
    pitch: float | None = None
    """Forward pitch of the torso [rad]; same default."""
    wrists: tuple[float, float, float, float, float, float] = (0.0,) * 6
    """Offsets of the left and right wrist, heading frame [m]."""
    request: State | None = None
    """State to enter."""
    seen: dict[str, tuple[float, ...]] = Field(default_factory=dict)
    """Measurements of the object by the names of the contract's inputs."""

    @property
    def commands(self) -> bool:
        """False for measurements of the object alone."""
        return self.model_fields_set != {"seen"}


class Udp:
    """JSON datagrams at a local port; see `Datagram`. Of datagrams that cannot be parsed only a request to damp counts;
    those with `seen` alone are no commands. A request counts once until a command has another or none, except to damp,
    so that a sender that repeats its request does not undo a watchdog's damping."""

    def __init__(self, ranges: Ranges, port: int) -> None:
        self.ranges = ranges
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind(("127.0.0.1", port))
        except OSError as error:
            raise UsageError(f"udp:{port}: {error}; choose another port") from error
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self._wanted = OperatorRequest(ranges.standing, -np.inf)
        self._requested: State | None = None
        """Request of the last command."""

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        request = None
        with contextlib.suppress(BlockingIOError):
            for _ in range(MOST_DATAGRAMS):
                data = self._socket.recv(LARGEST_DATAGRAM)
                with contextlib.suppress(ValueError, RecursionError):
                    content = json.loads(data)
                    if isinstance(content, dict) and content.get("request") == State.DAMPING:
                        request = State.DAMPING  # whatever else is wrong
                    given = Datagram.model_validate(content)
                    self._wanted = self._given(given, now)
                    if given.commands:
                        if request is not State.DAMPING and given.request is not self._requested:
                            request = given.request or request
                        self._requested = given.request
        return replace(self._wanted, request=request)

    def discard(self) -> None:
        with contextlib.suppress(BlockingIOError):
            for _ in range(BACKLOG):
                self._socket.recv(LARGEST_DATAGRAM)

    def close(self) -> None:
        self._socket.close()

    def _given(self, given: Datagram, now: float) -> OperatorRequest:
        command = self.ranges.standing.copy()
        command[:HEIGHT] = *given.velocity, given.yaw_rate
        for place, value in ((HEIGHT, given.height), (PITCH, given.pitch)):
            command[place] = command[place] if value is None else value
        command[OFFSET] = given.wrists
        command = np.where(np.isfinite(command), self.ranges.clipped(command), self.ranges.standing)
        sizes = {name: len(values) for name, values in given.seen.items()}
        known = self.ranges.seen.items() & sizes.items()  # a measurement of another size is ignored
        seen: dict[str, Any] = {name: np.array([given.seen[name]]) for name, _ in known}
        seen_at = now if seen else self._wanted.seen_at
        if not given.commands:
            return replace(self._wanted, seen=seen or self._wanted.seen, seen_at=seen_at)
        return OperatorRequest(command, now, None, seen or self._wanted.seen, seen_at)


@dataclass(frozen=True)
class OperatorWithPoses:
    """An operator with a separate source of object poses."""

    operator: Operator
    poses: Udp
    """Only `seen` of its datagrams is used."""

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        pose = self.poses.wanted(now, state)
        return replace(self.operator.wanted(now, state), seen=pose.seen, seen_at=pose.seen_at)


def operator(kind: str, contract: Contract) -> Remote | Keyboard | Udp:
    """The operator that `--commands` names. Raises UsageError."""
    ranges = Ranges(contract)
    if kind == "remote":
        return Remote(ranges)
    if kind == "keyboard":
        return Keyboard(ranges)
    return Udp(ranges, udp_port(kind, "--commands", "remote, keyboard, udp:PORT"))


def udp_port(kind: str, option: str, valid: str = "udp:PORT") -> int:
    """The port that the value `kind` of an option names. Raises UsageError with the valid values."""
    name, _, port = kind.partition(":")
    if name == "udp" and port.isdecimal() and int(port) < 65536:
        return int(port)
    raise UsageError(f"{option} {kind}: valid: {valid}")
