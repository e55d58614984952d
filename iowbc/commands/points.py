"""Runs several recipes at once, each in a process or a thread of its own with its own log."""

import multiprocessing
import os
import re
import signal
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor
from concurrent.futures import wait as futures_wait
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.context import ForkProcess
from pathlib import Path

from rich.console import Console

from iowbc.pipeline.console.board import Board, last_line
from iowbc.pipeline.stop_request import StopRequest
from iowbc.processes import die_with_parent

DONE, STAGE_FAILED, INTERRUPTED = 0, 1, 130
"""Exit codes of a recipe's run."""
POLL = 0.1
"""Seconds between two looks at the runs."""
PATIENCE = 10.0
"""Seconds that an aborted run has to end by itself."""
LOG_WIDTH = 160
"""Characters in a line of a table in a log."""
FAILURE = re.compile(r"^\S+ failed: .*")
"""The line of a log that says what failed."""
Codes = dict[str, int | None]
"""Exit code of each run by its name; None of one that never began."""


@dataclass(frozen=True)
class Task:
    """A recipe's run among others."""

    name: str
    log: Path
    """What it prints."""
    run: Callable[[Console], int]
    """Runs it, prints to a console, and returns the exit code."""


def run_threads(tasks: Sequence[Task], jobs: int, stop: StopRequest, board: Board, abort: Callable[[], None]) -> Codes:
    """Run all as `run_processes` does, in threads of this process: for runs whose stages are carried out elsewhere.

    abort: lets all that run end at once.
    """
    codes: Codes = {task.name: None for task in tasks}
    with ThreadPoolExecutor(jobs) as threads:
        futures = {threads.submit(_begin, task, stop, board): task for task in tasks}
        try:
            while futures:
                over, _ = futures_wait(futures, POLL, FIRST_COMPLETED)
                for future in over:
                    task = futures.pop(future)
                    codes[task.name] = future.result()
                    if codes[task.name] is not None:
                        board.ended(task.name, *_outcome(task, codes[task.name]))
                board.refresh()
        except KeyboardInterrupt:
            abort()
            raise
    return codes


def _begin(task: Task, stop: StopRequest, board: Board) -> int | None:
    """Run a task in this thread, unless a stop was asked for before."""
    if stop():
        return None
    board.began(task.name)
    task.log.parent.mkdir(parents=True, exist_ok=True)
    with task.log.open("a", encoding="utf-8") as log:
        try:
            return task.run(Console(file=log, width=LOG_WIDTH))
        except Exception:
            log.write(traceback.format_exc())
            return STAGE_FAILED


def run_processes(tasks: Sequence[Task], jobs: int, stop: StopRequest, board: Board) -> Codes:
    """Run all, each in a process, at most `jobs` at a time.

    One that fails does not stop the others. Once `stop` is asked for, all that run are asked to stop after a
    checkpoint, and none begins. Raises `KeyboardInterrupt` when asked twice, after all have ended.
    """
    codes: Codes = {task.name: None for task in tasks}
    waiting, running = deque(tasks), dict[Task, ForkProcess]()
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
            wait([process.sentinel for process in running.values()], POLL)
            for task in [task for task, process in running.items() if process.exitcode is not None]:
                codes[task.name] = running.pop(task).exitcode
                board.ended(task.name, *_outcome(task, codes[task.name]))
            board.refresh()
    except KeyboardInterrupt:
        _signal(running.values())
        raise
    finally:
        _end(running.values())
    return codes


def _started(task: Task) -> ForkProcess:
    """A run in a process of its own. It is a copy of this one, which has no other threads: it starts at once, knows the
    same stages, and hears a signal from its first moment."""
    process = multiprocessing.get_context("fork").Process(target=_run, args=(task, os.getpid()), name=task.name)
    process.start()
    return process


def _run(task: Task, parent: int) -> None:
    os.setpgid(0, 0)  # Ctrl-C reaches the sweep alone, which passes it on once
    die_with_parent(parent)
    task.log.parent.mkdir(parents=True, exist_ok=True)
    log = os.open(task.log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    for descriptor in (1, 2):
        os.dup2(log, descriptor)
    os.close(log)
    sys.exit(task.run(Console(file=sys.stdout, width=LOG_WIDTH)))


def _outcome(task: Task, code: int | None) -> tuple[str, str]:
    """How a run has ended, and what to say about it."""
    if code == DONE:
        return "done", ""
    if code == INTERRUPTED:
        return "stopped", ""
    if code is not None and code < 0:
        return "failed", f"killed by {signal.Signals(-code).name}; log {task.log}"
    return "failed", f"{failure(task.log)}; log {task.log}"


def failure(log: Path) -> str:
    """What a log says that failed, else its last line."""
    try:
        lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line for line in reversed(lines) if FAILURE.match(line)), last_line(log))


def _signal(processes: Iterable[ForkProcess]) -> None:
    """Ask runs to stop; asked again, they abort."""
    for process in processes:
        if process.exitcode is None and process.pid is not None:
            os.kill(process.pid, signal.SIGTERM)


def _end(processes: Iterable[ForkProcess]) -> None:
    """Wait for runs that were aborted, and kill those that do not end."""
    limit = time.monotonic() + PATIENCE
    for process in processes:
        process.join(max(0.0, limit - time.monotonic()))
        if process.exitcode is None:
            process.kill()
            process.join()
