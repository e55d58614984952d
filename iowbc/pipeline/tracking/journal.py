"""The journal of a run: all tracking data as lines of JSON, on disk before they are sent to MLflow.

The first line names the destination. Each further line is one event: `run` (a run begins, `parent` for a nested one),
`reopen`, `tags`, `metrics`, `files` or `end`. Every line ends with a checksum; a line that does not match it is
skipped. The journal is locked while its process is alive: an unlocked journal with unfinished runs belongs to a dead
process.
"""

import contextlib
import json
import os
import re
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from iowbc.errors import Damaged
from iowbc.files import read_checked, write_checked
from iowbc.pipeline.store.locks import taken

PARENT = "recipe"
"""Identifier of the parent run within a journal; a nested run has its stage's name."""
CHECKSUM = re.compile(rb'(.*), "check": "([0-9a-f]{8})"}\n', re.DOTALL)
"""A line: all but the closing brace of its event, and the CRC-32 of the event."""


class Journal:
    """A journal open for writing by this process only."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("ab", buffering=0)

    def acquire(self, patience: float = 0.0) -> bool:
        """Take the journal for this process, without a half-written last line of a process that died; False where
        another one keeps it longer than `patience` [s]."""
        limit = time.monotonic() + patience
        while not taken(self._file):
            if time.monotonic() >= limit:
                return False
            time.sleep(0.01)
        written = self.path.read_bytes()
        if not written.endswith(b"\n"):
            os.truncate(self.path, written.rfind(b"\n") + 1)
        return True

    def write(self, event: str, **fields: Any) -> None:
        """Append one event with the time [ms since 1970], whole or not at all. Raises `OSError` with the path."""
        text = json.dumps({"event": event, "time": int(time.time() * 1000), **fields}).encode()
        line = text[:-1] + b', "check": "%08x"}\n' % zlib.crc32(text)
        start = os.fstat(self._file.fileno()).st_size
        try:
            while line:
                line = line[self._file.write(line) :]
        except OSError as error:
            with contextlib.suppress(OSError):
                os.truncate(self.path, start)
            raise OSError(error.errno, error.strerror, str(self.path)) from error

    def close(self) -> None:
        self._file.close()


def lines(path: Path, offset: int = 0) -> Iterator[tuple[dict[str, Any] | None, int]]:
    """Events after a byte offset, each with the offset behind it; None for a line that is damaged."""
    with contextlib.suppress(FileNotFoundError), path.open("rb") as file:
        file.seek(offset)
        for line in file:
            if not line.endswith(b"\n"):
                return
            offset += len(line)
            yield _event(line), offset


def _event(line: bytes) -> dict[str, Any] | None:
    checked = CHECKSUM.fullmatch(line)
    if checked is None or zlib.crc32(checked[1] + b"}") != int(checked[2], 16):
        return None
    event: dict[str, Any] = json.loads(line)
    return event


def events(path: Path) -> Iterator[dict[str, Any]]:
    return (event for event, _ in lines(path) if event is not None)


def statuses(path: Path) -> dict[str, str]:
    """The status of every run in a journal: `RUNNING`, or that of its end."""
    found: dict[str, str] = {}
    for event in events(path):
        if event["event"] in ("run", "reopen"):
            found[event["id"]] = "RUNNING"
        elif event["event"] == "end":
            found[event["id"]] = event["status"]
    return found


def header(path: Path) -> dict[str, Any]:
    """The first line of a journal, which says where it goes; empty where there is none, or a damaged one."""
    return next((event for event in events(path) if event["event"] == "journal"), {})


def close_orphaned(path: Path) -> bool:
    """End the runs of a journal whose process died as KILLED. False while the process lives."""
    with contextlib.closing(Journal(path)) as journal:
        if not journal.acquire():
            return False
        for run, status in reversed(statuses(path).items()):
            if status == "RUNNING":
                journal.write("end", id=run, status="KILLED")
    return True


def sent_path(path: Path) -> Path:
    """File beside a journal with the number of bytes sent."""
    return path.with_suffix(".sent")


def sent(path: Path) -> int:
    """Number of bytes of a journal that MLflow has."""
    try:
        offset = int(json.loads(read_checked(sent_path(path), path.stem) or b"{}").get("offset", 0))
        return offset if offset <= path.stat().st_size else 0
    except (Damaged, OSError):
        return 0


def mark_sent(path: Path, offset: int) -> None:
    """Record that MLflow has a journal up to an offset."""
    write_checked(sent_path(path), path.stem, json.dumps({"offset": offset}).encode())


def unsent(path: Path) -> bool:
    """True while part of a journal is unsent; a sender may remove a fully sent journal at any time."""
    try:
        return sent(path) < path.stat().st_size
    except FileNotFoundError:
        return False
