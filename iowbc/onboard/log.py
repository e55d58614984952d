"""Log of a robot: all messages and inputs of the state machine, in the MCAP format; and its replay.

All messages of a cycle of the loop share a time stamp: first `inputs`, last the low-level command.
"""

import contextlib
import json
import os
import queue
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np
from mcap.reader import NonSeekingReader
from mcap.writer import MCAP0_MAGIC, Writer

from iowbc.deploy.controller import Controller
from iowbc.errors import Damaged, UsageError
from iowbc.onboard import messages
from iowbc.onboard.checks import SafetyLimits
from iowbc.onboard.machine import CycleInputs, Machine, OperatorRequest, State
from iowbc.onboard.messages import LOW_COMMAND, LOW_STATE, TOPICS, Record, from_cdr, to_cdr

JSON_TOPICS = ("inputs", "event", "timing")
ABOUT = "iowbc"
"""Name of the metadata that a replay needs."""


class Background:
    """Passes items to a function in a thread of its own, so that a slow disk or terminal does not delay a loop, until
    the function raises OSError."""

    def __init__(self, name: str, function: Callable[[Any], None], patience: float | None = None) -> None:
        """`patience`: longest wait for the items that are left at the end [s]; None waits for all."""
        self.failure = ""
        """Reason why no further items are passed."""
        self._function, self._patience, self._items = function, patience, queue.SimpleQueue[Any]()
        self._thread = threading.Thread(target=self._run, name=name, daemon=patience is not None)
        self._thread.start()

    def put(self, item: Any) -> None:
        self._items.put(item)

    def _run(self) -> None:
        try:
            while (item := self._items.get()) is not None:
                self._function(item)
        except OSError as error:
            self.failure = error.strerror or str(error)

    def close(self) -> None:
        self._items.put(None)
        self._thread.join(self._patience)


class LogWriter(Background):
    """Writes a log in its own thread; its `failure` says why the file can no longer be written."""

    def __init__(self, path: Path, about: dict[str, str]) -> None:
        """`about`: metadata for the replay. Raises UsageError if the file cannot be written."""
        try:
            self._file = path.open("xb")
        except OSError as error:
            raise UsageError(f"--log {path}: {error.strerror}; name a new file in a folder that exists") from error
        self._writer = Writer(self._file)
        self._writer.start(profile="iowbc", library="iowbc")
        self._writer.add_metadata(ABOUT, about)
        self._channels: dict[str, int] = {}
        for kind in (LOW_STATE, LOW_COMMAND):
            name = f"unitree_hg/msg/dds_/{messages.NAMES[kind]}"
            schema = self._writer.register_schema(name, "omgidl", messages.idl(kind).encode())
            self._channels[TOPICS[kind]] = self._writer.register_channel(TOPICS[kind], "cdr", schema)
        for topic in JSON_TOPICS:
            schema = self._writer.register_schema(topic, "jsonschema", b'{"type": "object"}')
            self._channels[topic] = self._writer.register_channel(topic, "json", schema)
        super().__init__("log", self._write)

    def turn(self, given: CycleInputs, command: Record) -> bool:
        """Logs a cycle; False if the file can no longer be written."""
        wanted = given.wanted
        self.add(
            "inputs",
            given.now,
            now=given.now,
            command=wanted.command.tolist(),
            at=_finite(wanted.at),
            request=wanted.request,
            seen={name: values.tolist() for name, values in wanted.seen.items()},
            seen_at=_finite(wanted.seen_at),
            others=given.others,
            charge=given.charge,
        )
        for state in given.states:
            self.put((TOPICS[LOW_STATE], given.now, to_cdr(state)))
        self.put((TOPICS[LOW_COMMAND], given.now, to_cdr(command)))
        return not self.failure

    def add(self, topic: str, at_time: float, **values: Any) -> None:
        """A JSON message at a time of the loop [s]."""
        self.put((topic, at_time, json.dumps(values).encode()))

    def _write(self, entry: tuple[str, float, bytes]) -> None:
        topic, now, data = entry
        time = round(1e9 * now)
        self._writer.add_message(self._channels[topic], time, data, time)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
        try:  # a file that cannot be finished is readable up to where it ends
            with self._file:
                if not self.failure:
                    self._writer.finish()
        except OSError as error:
            self.failure = self.failure or error.strerror or str(error)


def _opened(path: Path) -> BinaryIO:
    """A log, to be read. Raises UsageError."""
    try:
        return path.open("rb")
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}; name a log of `iowbc robot`") from error


def read_about(path: Path) -> dict[str, str]:
    """Metadata of a log of `iowbc robot`. Raises UsageError for a missing file, Damaged for another one."""
    with _opened(path) as file:
        try:
            named = (entry.metadata for entry in NonSeekingReader(file).iter_metadata() if entry.name == ABOUT)
            about = next(named, None)  # at the beginning, so that a cut file has it
        except Exception as error:
            raise Damaged(f"{path}: cannot be read as MCAP: {type(error).__name__} {error}") from error
    if about is None:
        raise Damaged(f"{path}: no log of `iowbc robot`")
    return dict(about)


def is_cut(path: Path) -> bool:
    """True for a log without its end, as of a process that was killed or a full disk. Raises UsageError."""
    with _opened(path) as file:
        file.seek(-min(len(MCAP0_MAGIC), file.seek(0, os.SEEK_END)), os.SEEK_END)
        return file.read() != MCAP0_MAGIC


def read_messages(path: Path) -> Iterator[tuple[str, float, bytes]]:
    """Topic, time [s] and data of every message, as written; a truncated file is read up to the cut. Raises UsageError
    for a missing file, Damaged for one that is damaged or has no message."""
    cut, found = is_cut(path), False
    with _opened(path) as file:
        try:
            for _, channel, message in NonSeekingReader(file, validate_crcs=True).iter_messages(log_time_order=False):
                found = True
                yield channel.topic, 1e-9 * message.log_time, message.data
        except Exception as error:  # type depends on where the file was cut
            if not (found and cut):
                raise Damaged(f"{path}: {type(error).__name__}: {error}") from error


@contextlib.contextmanager
def _of_this_version(path: Path) -> Iterator[None]:
    """Raises Damaged where the content of a log is not that of this version."""
    try:
        yield
    except (KeyError, TypeError, ValueError) as error:
        text = f"content that this version does not read: {type(error).__name__}: {error}"
        raise Damaged(f"{path}: {text}; the log may be of another version of iowbc") from error


def read_states(path: Path) -> Iterator[tuple[float, State]]:
    """Time [s] and state at each event, in order. Raises Damaged and UsageError."""
    for topic, time, data in read_messages(path):
        if topic == "event":
            with _of_this_version(path):
                state = State(json.loads(data)["state"])
            yield time, state


def read_cycles(path: Path) -> Iterator[tuple[CycleInputs, Record]]:
    """Inputs and command of each cycle, in order. Raises Damaged and UsageError."""
    inputs: dict[str, Any] | None = None
    states: list[Record] = []
    for topic, _, data in read_messages(path):
        cycle = None
        with _of_this_version(path):
            if topic == "inputs":
                inputs, states = json.loads(data), []
            elif topic == TOPICS[LOW_STATE]:
                states.append(from_cdr(LOW_STATE, data))
            elif topic == TOPICS[LOW_COMMAND] and inputs is not None:
                cycle = _inputs(inputs, states), from_cdr(LOW_COMMAND, data)
        if cycle is not None:
            yield cycle


def _inputs(logged: dict[str, Any], states: list[Record]) -> CycleInputs:
    request = logged["request"]
    wanted = OperatorRequest(
        command=np.array(logged["command"]),
        at=_never(logged["at"]),
        request=None if request is None else State(request),
        seen={name: np.array(values) for name, values in logged["seen"].items()},
        seen_at=_never(logged["seen_at"]),
    )
    return CycleInputs(logged["now"], tuple(states), wanted, logged["others"], logged.get("charge"))


def _finite(time: float) -> float | None:
    """A time for JSON, which has no infinity."""
    return time if np.isfinite(time) else None


def _never(time: float | None) -> float:
    return -np.inf if time is None else time


def export_digest(controller: Controller) -> str:
    """Identity of an export in a log: the SHA-256 digests of its files."""
    return ",".join(f"{name}:{value}" for name, value in sorted(controller.contract.files.items()))


def replay(path: Path, folder: Path) -> tuple[int, int]:
    """Replays a log's inputs through the state machine of the exported controller in `folder`; returns the number of
    cycles, and of those whose command is not bit-identical. Raises UsageError for the log of another export, Damaged
    for a file that is no log."""
    about = read_about(path)
    controller = Controller.load(folder)
    with _of_this_version(path):
        if export_digest(controller) != about["export"]:
            raise UsageError(f"{path}: logged with another export ({about['recipe']}); give the folder of that one")
        machine = Machine(controller, about["scene"], SafetyLimits.model_validate_json(about["limits"]))
    turns = different = 0
    for given, command in read_cycles(path):
        turns += 1
        different += machine.turn(given).tobytes() != command.tobytes()
    return turns, different
