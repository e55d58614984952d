"""The journal of a run: all that MLflow is to know, as lines of JSON on disk before anything is sent.

The first line says where it goes. Each further line is one event: `run` (a run begins, `parent` for a nested one),
`reopen`, `tags`, `metrics`, `text`, `files` or `end`, and ends with a checksum: a line that differs from it is passed
over. While its process lives, the journal is locked; a journal that is not locked and has runs without an end belonged
to a process that died.
"""

import contextlib
import fcntl
import json
import os
import re
import time
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from iowbc.errors import Damaged
from iowbc.files import read_checked, write_checked

EVENTS = ("journal", "run", "reopen", "tags", "metrics", "text", "files", "end")
CHECKSUM = re.compile(rb'(.*), "check": "([0-9a-f]{8})"}\n', re.DOTALL)
"""A line: all but the closing brace of its event, and the CRC-32 of the event."""


def now() -> int:
    """The time as MLflow counts it [ms since 1970]."""
    return int(time.time() * 1000)


class Journal:
    """A journal that this process writes, alone."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("ab", buffering=0)

    def acquire(self, patience: float = 0.0) -> bool:
        """Take the journal for this process; False where another one keeps it longer than `patience` [s].

        A half-written last line is cut off.
        """
        limit = time.monotonic() + patience
        while True:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if time.monotonic() >= limit:
                    return False
                time.sleep(0.01)
        self._mend()
        return True

    def _mend(self) -> None:
        """Cut off a last line that a dying process left half written."""
        size = self.path.stat().st_size
        with self.path.open("rb") as file:
            file.seek(max(0, size - 1))
            if size == 0 or file.read(1) == b"\n":
                return
            file.seek(0)
            os.truncate(self.path, file.read().rfind(b"\n") + 1)

    def write(self, event: str, **fields: Any) -> None:
        """Append one event with the time, whole or not at all. Raises `OSError` with the journal's path."""
        told = json.dumps({"event": event, "time": now(), **fields}).encode()
        line = told[:-1] + b', "check": "%08x"}\n' % zlib.crc32(told)
        start = os.fstat(self._file.fileno()).st_size
        try:
            while line:
                line = line[self._file.write(line) :]
        except OSError as error:
            with contextlib.suppress(OSError):
                os.truncate(self.path, start)
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def close(self) -> None:
        """Release the journal."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def lines(path: Path, offset: int = 0) -> Iterator[tuple[dict[str, Any] | None, int]]:
    """Events after a byte offset, each with the offset behind it; None for a line that is damaged."""
    try:
        file = path.open("rb")
    except FileNotFoundError:
        return
    with file:
        file.seek(offset)
        for line in file:
            if not line.endswith(b"\n"):
                return
            offset += len(line)
            yield _event(line), offset


def _event(line: bytes) -> dict[str, Any] | None:
    checked = CHECKSUM.fullmatch(line)
    if checked is not None and zlib.crc32(checked[1] + b"}") != int(checked[2], 16):
        return None
    try:
        found = json.loads(line)
    except (ValueError, RecursionError):
        return None
    if not isinstance(found, dict) or found.get("event") not in EVENTS:
        return None
    return found if found["event"] == "journal" or isinstance(found.get("id"), str) else None


def events(path: Path) -> Iterator[dict[str, Any]]:
    """All whole events."""
    return (event for event, _ in lines(path) if event is not None)


def statuses(path: Path, end: int | None = None) -> dict[str, str]:
    """The status of every run in a journal, or in its first bytes: `RUNNING`, or what its end said."""
    found: dict[str, str] = {}
    for event, behind in lines(path):
        if end is not None and behind > end:
            break
        if event is not None:
            note_status(found, event)
    return found


def note_status(found: dict[str, str], event: Mapping[str, Any]) -> None:
    """Take one more event into account."""
    if event["event"] in ("run", "reopen"):
        found[event["id"]] = "RUNNING"
    elif event["event"] == "end":
        found[event["id"]] = event["status"]


def header(path: Path) -> dict[str, Any]:
    """The first line of a journal, which says where it goes; empty where there is none, or a damaged one."""
    return next((event for event in events(path) if event["event"] == "journal"), {})


def lives(path: Path) -> bool:
    """Whether the process that writes a journal lives."""
    with Journal(path) as journal:
        return not journal.acquire()


def close_orphaned(path: Path) -> bool:
    """End the runs of a journal whose process died as KILLED. False while the process lives."""
    with Journal(path) as journal:
        if not journal.acquire():
            return False
        for run, status in reversed(statuses(path).items()):
            if status == "RUNNING":
                journal.write("end", id=run, status="KILLED")
    return True


def sent_path(path: Path) -> Path:
    """Where it is kept how far a journal has been sent."""
    return path.with_suffix(".sent")


def sent(path: Path) -> tuple[int, dict[str, str]]:
    """How many bytes of a journal MLflow has, and MLflow's identifier of each run; none where that is not known."""
    try:
        content = read_checked(sent_path(path), path.stem)
    except (Damaged, OSError):
        content = None
    state: dict[str, Any] = json.loads(content) if content is not None else {"offset": 0, "ids": {}}
    return (state["offset"], state["ids"]) if state["offset"] <= _size(path) else (0, {})


def mark_sent(path: Path, offset: int, ids: Mapping[str, str]) -> None:
    """Record that MLflow has a journal up to an offset."""
    write_checked(sent_path(path), path.stem, json.dumps({"offset": offset, "ids": dict(ids)}).encode())


def unsent(path: Path) -> bool:
    """True while MLflow lacks something of a journal; a sender may remove it at any moment, once it has all."""
    return sent(path)[0] < _size(path)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0
