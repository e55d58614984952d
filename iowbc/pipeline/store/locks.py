"""One process a key: a lock that the system releases when its holder dies."""

import fcntl
import json
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from iowbc.pipeline.machine import host
from iowbc.pipeline.store.runs import Runs, read_json

POLL = 0.2
"""Seconds between two attempts to take a lock that another process holds."""


@dataclass(frozen=True)
class Holder:
    """Holder of a lock."""

    pid: int
    host: str
    since: float
    """When the lock was taken [s since 1970]."""

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host} since {time.strftime('%H:%M:%S', time.localtime(self.since))}"


def lock_path(runs: Runs, key: str) -> Path:
    """The lock file of a key; it is never removed while runs are going on."""
    return runs.locks / f"{key}.lock"


def holder(runs: Runs, key: str) -> Holder | None:
    """Holder of a key at this moment, or None."""
    path = lock_path(runs, key)
    if not path.exists():
        return None
    with path.open("a") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return _read(path)
    return None


@contextmanager
def key_lock(
    runs: Runs, key: str, on_wait: Callable[[Holder], None], interrupted: Callable[[], bool]
) -> Iterator[bool]:
    """Hold a key's lock, waiting for another holder after `on_wait` was told who it is.

    Yields False, without the lock, when `interrupted` turned true while waiting.
    """
    runs.locks.mkdir(parents=True, exist_ok=True)
    with lock_path(runs, key).open("a+") as file:
        told = False
        while True:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if interrupted():
                    yield False
                    return
                if not told:
                    on_wait(_read(lock_path(runs, key)))
                    told = True
                time.sleep(POLL)
        file.seek(0)
        file.truncate()
        json.dump({"pid": os.getpid(), "host": host(), "since": time.time()}, file)
        file.flush()
        yield True


@contextmanager
def named_lock(path: Path) -> Iterator[None]:
    """Hold the lock of a file; waits for another holder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _read(path: Path) -> Holder:
    """The holder that a lock file names; one that is being written, or was overwritten, names nobody."""
    data = read_json(path)
    pid, name, since = (data.get(key) for key in ("pid", "host", "since"))
    known = isinstance(pid, int) and isinstance(since, (int, float))
    return Holder(pid, str(name), since) if known else Holder(0, "?", time.time())  # type: ignore[arg-type]
