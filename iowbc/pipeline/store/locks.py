"""File locks, one per key, which the system releases when the holder dies."""

import fcntl
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from socket import gethostname
from typing import IO, Any

from pydantic import BaseModel, Field

from iowbc.pipeline.store.runs import Runs, read_record

POLL = 0.2
"""Seconds between two attempts to take a lock that another process holds."""


class Holder(BaseModel, frozen=True):
    """Holder of a lock; its fields have defaults if the lock file is being written or unreadable."""

    pid: int = 0
    host: str = "?"
    since: float = Field(default_factory=time.time)
    """Time of acquisition [s since 1970]."""

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
    with path.open("rb") as file:
        return None if taken(file, fcntl.LOCK_SH) else read_record(Holder, path) or Holder()


def taken(file: IO[Any], operation: int = fcntl.LOCK_EX) -> bool:
    """Take the lock of an open file; False where another process holds it."""
    try:
        fcntl.flock(file, operation | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


@contextmanager
def key_lock(
    runs: Runs, key: str, on_wait: Callable[[Holder], None], interrupted: Callable[[], bool]
) -> Iterator[bool]:
    """Hold a key's lock. If another process holds it, call `on_wait` with that holder and wait; yields False, without
    the lock, if `interrupted` becomes true meanwhile."""
    runs.locks.mkdir(parents=True, exist_ok=True)
    with lock_path(runs, key).open("a+") as file:
        reported = False
        while not taken(file):
            if interrupted():
                yield False
                return
            if not reported:
                on_wait(read_record(Holder, lock_path(runs, key)) or Holder())
                reported = True
            time.sleep(POLL)
        file.seek(0)
        file.truncate()
        file.write(Holder(pid=os.getpid(), host=gethostname()).model_dump_json())
        file.flush()
        yield True


@contextmanager
def named_lock(path: Path) -> Iterator[None]:
    """Hold the lock of a file; waits for another holder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
