"""Runs several recipes at once, each in a process or a thread of its own with its own log."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import IO

from rich.console import Console

from iowbc.commands.process import NOT_BEGUN, STAGE_FAILED, RunEnding
from iowbc.pipeline.console.board import Board, last_line
from iowbc.pipeline.stop_request import StopRequest
from iowbc.processes import die_with_parent

POLL = 0.1
"""Polling interval [s]."""
PATIENCE = 10.0
"""Seconds that an aborted run has to end by itself."""
LOG_WIDTH = 160
"""Width of a log [characters]."""
Endings = dict[str, RunEnding]
"""Ending of each run by name."""


@dataclass(frozen=True)
class PointRun:
    """One of several runs."""

    name: str
    log: Path
    run: Callable[..., RunEnding]
    """Runs it with a `console`, and one for `errors`."""

    def carried_out(self, output: IO[str]) -> RunEnding:
        """Run it and print all to a file."""
        console = Console(file=output, width=LOG_WIDTH)
        return self.run(console=console, errors=console)


def run_points(
    tasks: Sequence[PointRun],
    jobs: int,
    stop: StopRequest,
    board: Board,
    start: "Callable[[PointRun], PointThread | PointProcess]",
) -> Endings:
    """Run all, at most `jobs` at a time; one that fails does not stop the others.

    Once `stop` is asked for, all that run are asked to stop after a checkpoint, and none begins. Raises
    `KeyboardInterrupt` when asked twice, after all have ended.
    """
    endings: Endings = {task.name: RunEnding(NOT_BEGUN) for task in tasks}
    waiting, running = deque(tasks), dict[PointRun, PointThread | PointProcess]()
    asked = False
    try:
        while (waiting and not stop()) or running:
            if stop() and not asked:
                asked = True
                for one in running.values():
                    one.stop()
            while waiting and len(running) < jobs and not stop():
                task = waiting.popleft()
                task.log.parent.mkdir(parents=True, exist_ok=True)
                running[task] = start(task)
                board.began(task.name)
            time.sleep(POLL)
            for task, one in [*running.items()]:
                if (ending := one.ending()) is not None:
                    del running[task]
                    endings[task.name] = ending
                    note = f"{ending.failure}; log {task.log}" if ending.state == "failed" else ""
                    board.ended(task.name, ending.state, note)
            board.refresh()
    except KeyboardInterrupt:
        for one in running.values():
            one.abort()
        raise
    finally:
        for one in running.values():
            one.join()
    return endings


class PointThread(threading.Thread):
    """A run in a thread, which sees the stop request itself: for stages that are carried out elsewhere."""

    def __init__(self, task: PointRun, abort: Callable[[], None]) -> None:
        """`abort`: aborts all runs at once."""
        super().__init__(name=task.name)
        self.task, self.abort = task, abort
        self._ending = RunEnding(STAGE_FAILED, f"its log {task.log} cannot be written")
        self.start()

    def run(self) -> None:
        with self.task.log.open("a", encoding="utf-8") as log:
            try:
                self._ending = self.task.carried_out(log)
            except BaseException as error:
                self._ending = RunEnding(STAGE_FAILED, f"{type(error).__name__}: {error}")
                log.write(traceback.format_exc())

    def ending(self) -> RunEnding | None:
        return None if self.is_alive() else self._ending

    def stop(self) -> None:
        """No action: the run polls the stop request itself."""


class PointProcess:
    """A run in a process forked from this one, which has no other threads; stages and signal handlers are the same."""

    def __init__(self, task: PointRun) -> None:
        context = multiprocessing.get_context("fork")
        self._log = task.log
        self._said, saying = context.Pipe(duplex=False)
        self._process = context.Process(target=_run, args=(task, os.getpid(), saying), name=task.name)
        self._process.start()
        saying.close()

    def ending(self) -> RunEnding | None:
        """Its ending, also if the process died without reporting one."""
        if (code := self._process.exitcode) is None:
            return None
        if self._said.poll():
            with contextlib.suppress(EOFError):
                return self._said.recv()
        code = code or STAGE_FAILED
        return RunEnding(code, f"killed by {signal.Signals(-code).name}" if code < 0 else last_line(self._log))

    def stop(self) -> None:
        self._process.terminate()

    abort = stop
    """The second signal aborts."""

    def join(self) -> None:
        """Wait for its end; kill it after `PATIENCE`."""
        self._process.join(PATIENCE)
        if self._process.exitcode is None:
            self._process.kill()
            self._process.join()


def _run(task: PointRun, parent: int, saying: Connection) -> None:
    os.setpgid(0, 0)  # Ctrl-C reaches only the sweep, which forwards it once
    die_with_parent(parent)
    log = os.open(task.log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    for descriptor in (1, 2):
        os.dup2(log, descriptor)
    os.close(log)
    ending = task.carried_out(sys.stdout)
    saying.send(replace(ending, artifacts={}))  # a pipe holds 64 KiB, and nobody reads before this process ends
    sys.exit(ending.code)
