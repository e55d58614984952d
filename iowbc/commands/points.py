"""Runs several recipes at once, each in a process or a thread of its own with its own log."""

import contextlib
import multiprocessing
import os
import signal
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor
from concurrent.futures import wait as futures_wait
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkProcess
from pathlib import Path

from rich.console import Console

from iowbc.commands.ending import DONE, INTERRUPTED, STAGE_FAILED, RunEnding
from iowbc.pipeline.console.board import Board, last_line
from iowbc.pipeline.stop_request import StopRequest
from iowbc.processes import die_with_parent

POLL = 0.1
"""Seconds between two looks at the runs."""
PATIENCE = 10.0
"""Seconds that an aborted run has to end by itself."""
LOG_WIDTH = 160
"""Characters in a line of a table in a log."""
Endings = dict[str, RunEnding | None]
"""Ending of each run by name; None for a run that never began."""


@dataclass(frozen=True)
class PointRun:
    """A recipe's run among others."""

    name: str
    log: Path
    """What it prints."""
    run: Callable[[Console], RunEnding]
    """Runs it and prints to a console."""


def run_threads(
    tasks: Sequence[PointRun], jobs: int, stop: StopRequest, board: Board, abort: Callable[[], None]
) -> Endings:
    """Run all as `run_processes` does, in threads of this process: for runs whose stages are carried out elsewhere.

    abort: lets all that run end at once.
    """
    endings: Endings = {task.name: None for task in tasks}
    with ThreadPoolExecutor(jobs) as threads:
        futures = {threads.submit(_begin, task, stop, board): task for task in tasks}
        try:
            while futures:
                over, _ = futures_wait(futures, POLL, FIRST_COMPLETED)
                for future in over:
                    task = futures.pop(future)
                    ending = endings[task.name] = future.result()
                    if ending is not None:
                        board.ended(task.name, *_outcome(task, ending))
                board.refresh()
        except KeyboardInterrupt:
            abort()
            raise
    return endings


def _begin(task: PointRun, stop: StopRequest, board: Board) -> RunEnding | None:
    """Run a task in this thread, unless a stop was asked for before."""
    if stop():
        return None
    board.began(task.name)
    task.log.parent.mkdir(parents=True, exist_ok=True)
    with task.log.open("a", encoding="utf-8") as log:
        try:
            return task.run(Console(file=log, width=LOG_WIDTH))
        except Exception as error:
            log.write(traceback.format_exc())
            return RunEnding(STAGE_FAILED, f"{type(error).__name__}: {error}")


def run_processes(tasks: Sequence[PointRun], jobs: int, stop: StopRequest, board: Board) -> Endings:
    """Run all, each in a process, at most `jobs` at a time.

    One that fails does not stop the others. Once `stop` is asked for, all that run are asked to stop after a
    checkpoint, and none begins. Raises `KeyboardInterrupt` when asked twice, after all have ended.
    """
    endings: Endings = {task.name: None for task in tasks}
    waiting, running = deque(tasks), dict[PointRun, PointProcess]()
    told = False
    try:
        while (waiting and not stop()) or running:
            if stop() and not told:
                told = True
                _signal(running.values())
            while waiting and len(running) < jobs and not stop():
                task = waiting.popleft()
                running[task] = _started(task)
                board.began(task.name)
            wait([one.process.sentinel for one in running.values()], POLL)
            for task in [task for task, one in running.items() if one.process.exitcode is not None]:
                ending = endings[task.name] = running.pop(task).ending(task)
                board.ended(task.name, *_outcome(task, ending))
            board.refresh()
    except KeyboardInterrupt:
        _signal(running.values())
        raise
    finally:
        _end(running.values())
    return endings


@dataclass(frozen=True)
class PointProcess:
    """The process of a run, and where it says how it ended."""

    process: ForkProcess
    said: Connection

    def ending(self, task: PointRun) -> RunEnding:
        """Ending of the run, also if its process died without reporting one."""
        if self.said.poll():
            with contextlib.suppress(EOFError):
                ending: RunEnding = self.said.recv()
                return ending
        code = self.process.exitcode or STAGE_FAILED
        return RunEnding(code, f"killed by {signal.Signals(-code).name}" if code < 0 else last_line(task.log))


def _started(task: PointRun) -> PointProcess:
    """A run in a process of its own. It is a copy of this one, which has no other threads: it starts at once, knows the
    same stages, and hears a signal from its first moment."""
    context = multiprocessing.get_context("fork")
    said, saying = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(task, os.getpid(), saying), name=task.name)
    process.start()
    saying.close()
    return PointProcess(process, said)


def _run(task: PointRun, parent: int, saying: Connection) -> None:
    os.setpgid(0, 0)  # Ctrl-C reaches the sweep alone, which passes it on once
    die_with_parent(parent)
    task.log.parent.mkdir(parents=True, exist_ok=True)
    log = os.open(task.log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    for descriptor in (1, 2):
        os.dup2(log, descriptor)
    os.close(log)
    ending = task.run(Console(file=sys.stdout, width=LOG_WIDTH))
    saying.send(ending)
    sys.exit(ending.code)


def _outcome(task: PointRun, ending: RunEnding) -> tuple[str, str]:
    """The state that is shown of a run which has ended, and what to say about it."""
    if ending.code in (DONE, INTERRUPTED):
        return ("done" if ending.code == DONE else "stopped"), ""
    return "failed", f"{ending.failure}; log {task.log}"


def _signal(points: Iterable[PointProcess]) -> None:
    """Ask runs to stop; asked again, they abort."""
    for process in (one.process for one in points):
        if process.exitcode is None and process.pid is not None:
            os.kill(process.pid, signal.SIGTERM)


def _end(points: Iterable[PointProcess]) -> None:
    """Wait for runs that were aborted, and kill those that do not end."""
    limit = time.monotonic() + PATIENCE
    for process in (one.process for one in points):
        process.join(max(0.0, limit - time.monotonic()))
        if process.exitcode is None:
            process.kill()
            process.join()
