"""The journal of a run: all that MLflow is to know, as lines of JSON on disk before anything is sent.

The first line says where it goes. Each further line is one event: `run` (a run begins, `parent` for a nested one),
`reopen`, `tags`, `metrics`, `text`, `files` or `end`. While its process lives, the journal is locked; a journal that is
not locked and has runs without an end belonged to a process that died.
"""

import fcntl
import json
import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from iowbc.files import write_whole
from iowbc.pipeline.store.runs import read_json


def now() -> int:
    """The time as MLflow counts it [ms since 1970]."""
    return int(time.time() * 1000)


class Journal:
    """A journal that this process writes, alone."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("ab")

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
        """Append one event with the time."""
        line = json.dumps({"event": event, "time": now(), **fields})
        self._file.write(line.encode() + b"\n")
        self._file.flush()

    def close(self) -> None:
        """Release the journal."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def events(path: Path, offset: int = 0) -> Iterator[tuple[dict[str, Any], int]]:
    """Whole events after a byte offset, each with the offset behind it."""
    with path.open("rb") as file:
        file.seek(offset)
        for line in file:
            if not line.endswith(b"\n"):
                return
            offset += len(line)
            yield json.loads(line), offset


def statuses(path: Path, end: int | None = None) -> dict[str, str]:
    """The status of every run in a journal, or in its first bytes: `RUNNING`, or what its end said."""
    found: dict[str, str] = {}
    for event, behind in events(path):
        if end is not None and behind > end:
            break
        note_status(found, event)
    return found


def note_status(found: dict[str, str], event: Mapping[str, Any]) -> None:
    """Take one more event into account."""
    if event["event"] in ("run", "reopen"):
        found[event["id"]] = "RUNNING"
    elif event["event"] == "end":
        found[event["id"]] = event["status"]


def header(path: Path) -> dict[str, Any]:
    """The first event of a journal; empty where there is none yet."""
    return next((event for event, _ in events(path)), {})


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
    """How many bytes of a journal MLflow has, and MLflow's identifier of each run."""
    state = read_json(sent_path(path)) or {}
    return int(state.get("offset", 0)), dict(state.get("ids", {}))


def mark_sent(path: Path, offset: int, ids: Mapping[str, str]) -> None:
    """Record that MLflow has a journal up to an offset."""
    write_whole(sent_path(path), json.dumps({"offset": offset, "ids": dict(ids)}))


def unsent(path: Path) -> bool:
    """True while MLflow lacks something of a journal."""
    return sent(path)[0] < path.stat().st_size
