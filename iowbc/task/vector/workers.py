"""Parent side of the worker processes: starts them, sends requests, detects crashes and hangs, and stops them."""

import json
import os
import pickle
import select
import signal
import socket
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Protocol

from iowbc.errors import WorkerFailed
from iowbc.processes import SINGLE_THREADED
from iowbc.rollouts.blocks import shares_in_blocks
from iowbc.task.record.statistics import COUNTERS
from iowbc.task.vector.shared import Buffers, Fields, create_shared, private_buffers
from iowbc.task.vector.worker import ASKED, Message

STARTING = 300.0
"""Timeout for building the environments [s]."""
LEAVING = 2.0
"""Time for workers to exit by themselves [s]."""
SLICE = 0.5
"""Timeouts are counted in waits of this length [s], so that a suspended machine does not use them up."""
STEPS = COUNTERS.index("steps")
"""Column of the counters that shows a worker's progress."""
TRACEBACK_TIME = 0.5
"""Time for a hung worker to write its traceback [s]."""


class Workers(Protocol):
    """Steps the environments, in consecutive groups."""

    groups: list[tuple[int, int]]
    """First and last environment (excluded) of each group."""
    buffers: Buffers
    """Arrays that all environments read and write."""

    def ask(self, messages: Sequence[Message]) -> None:
        """Sends each group its message, in their order."""

    def answers(self) -> list[Any]:
        """Replies of the groups, in their order."""

    def call(self, messages: Sequence[Message]) -> list[Any]:
        """Replies of the groups to messages."""
        self.ask(messages)
        return self.answers()

    def close(self) -> None:
        """Stops the workers."""


class Building(Protocol):
    """Interface of a setup from which a process builds its environments, such as `Setup`."""

    @property
    def count(self) -> int:
        """Number of environments."""

    def buffer_fields(self) -> Fields:
        """Arrays exchanged between the environments and the parent, with the counters of steps."""

    def batch(self, first: int, last: int, buffers: Buffers) -> Any:
        """The environments from `first` to `last`, the latter excluded."""


class InProcess(Workers):
    """All environments in this process."""

    def __init__(self, setup: Building) -> None:
        self.groups = [(0, setup.count)]
        self.buffers = private_buffers(setup.buffer_fields(), setup.count)
        self.batch: Any = setup.batch(0, setup.count, self.buffers)
        self._answer: Any = None

    def ask(self, messages: Sequence[Message]) -> None:
        (message,) = messages
        self._answer = message.carry_out(self.batch)

    def answers(self) -> list[Any]:
        return [self._answer]

    def close(self) -> None:
        """There is nothing to stop."""


@dataclass
class WorkerProcess:
    popen: subprocess.Popen[bytes]
    connection: Connection
    log: int
    """File descriptor to which the worker writes its traceback when it crashes or hangs."""


class WorkerProcesses(Workers):
    """Environments spread over worker processes, which share memory with this one."""

    def __init__(self, setup: Building, count: int, patience: float) -> None:
        """`patience`: how long a request may take before a worker counts as hung [s]."""
        self.groups = shares_in_blocks(setup.count, count)
        self._patience = patience
        fields = setup.buffer_fields()
        memory, self.buffers = create_shared(fields, setup.count)
        self._processes: list[WorkerProcess] = []
        self._pipes: dict[int, int] = {}
        self._poll = select.poll()
        self._ended = weakref.finalize(self, _end, self._processes, os.getpid())
        self._asked: set[int] = set()
        self._answers: list[Any] = [None for _ in self.groups]
        try:
            for _ in self.groups:
                process = _start(memory)
                self._pipes[process.connection.fileno()] = len(self._processes)
                self._poll.register(process.connection.fileno(), select.POLLIN)
                self._processes.append(process)
            for index, ((first, last), process) in enumerate(zip(self.groups, self._processes, strict=True)):
                process.connection.send((setup, first, last))
                self._asked.add(index)
            self._wait(STARTING)
        except BaseException:
            self.close()
            raise
        finally:
            os.close(memory)

    @property
    def processes(self) -> list[int]:
        return [process.popen.pid for process in self._processes]

    def ask(self, messages: Sequence[Message]) -> None:
        """See `Workers`. Replies left over from an interruption are discarded first."""
        if not self._ended.alive:
            raise WorkerFailed("the worker processes have ended; make a new vector environment")
        self._wait(self._patience)
        pickled = [pickle.dumps(message) for message in messages]
        for index, (process, message) in enumerate(zip(self._processes, pickled, strict=True)):
            try:
                process.connection.send_bytes(message)
            except (BrokenPipeError, ConnectionResetError):
                self._fail(index)
            self._asked.add(index)

    def answers(self) -> list[Any]:
        """Raises WorkerFailed."""
        self._wait(self._patience)
        return self._answers

    def close(self) -> None:
        """See `Workers`. Workers leave when their pipe closes; those that do not are killed."""
        self._ended()

    def _wait(self, patience: float) -> None:
        """Waits for all replies. Every step of a rollout restarts the timeout `patience`."""
        left, steps = patience, self._steps()
        while self._asked:
            ready = {self._pipes[pipe] for pipe, _ in self._poll.poll(1e3 * SLICE)}
            for index in sorted(ready & self._asked):
                self._receive(index)
            before, steps = steps, self._steps()
            left = patience if steps != before else left - (0.0 if ready else SLICE)
            if left <= 0.0 and self._asked:
                self._fail(min(self._asked), hung=patience)

    def _steps(self) -> float:
        """Sum of the step counters of the busy workers' environments."""
        rows = [slice(*self.groups[index]) for index in self._asked]
        return float(sum(self.buffers["counters"][row, STEPS].sum() for row in rows))

    def _receive(self, index: int) -> None:
        try:
            fine, answer = self._processes[index].connection.recv()
        except (EOFError, ConnectionResetError):
            self._fail(index)
        if not fine:
            self._fail(index, text=answer)
        self._answers[index] = answer
        self._asked.discard(index)

    def _fail(self, index: int, *, text: str = "", hung: float | None = None) -> None:
        process = self._processes[index]
        first, last = self.groups[index]
        who = f"worker {index} (process {process.popen.pid}, environments {first} to {last - 1})"
        if hung is not None:
            process.popen.send_signal(signal.SIGUSR1)
            time.sleep(TRACEBACK_TIME)
            what = f"has not answered for {hung:g} s"
        elif text:
            what = "failed"
        else:
            what = _end_of(process.popen)
        text = (text or os.pread(process.log, os.fstat(process.log).st_size, 0).decode(errors="replace")).rstrip()
        self.close()
        raise WorkerFailed(f"{who} {what}\n{text or 'it left no traceback; see its output above'}")


def _start(memory: int) -> WorkerProcess:
    """Starts a worker process. Signals to stop are blocked from its start, because the parent stops it."""
    ours, theirs = socket.socketpair()
    log = os.memfd_create("iowbc-worker-log", os.MFD_CLOEXEC)
    bound = threading.current_thread() is threading.main_thread()
    descriptors = (theirs.fileno(), memory, log)
    environment = os.environ | SINGLE_THREADED
    arguments = [json.dumps(sys.path), os.getpid(), int(bound), *descriptors]
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    try:
        popen = subprocess.Popen(
            [sys.executable, "-c", ASKED, *map(str, arguments)],
            stdin=subprocess.DEVNULL,
            pass_fds=descriptors,
            env=environment,
        )
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        theirs.close()
    return WorkerProcess(popen, Connection(ours.detach()), log)


def _end_of(popen: subprocess.Popen[bytes]) -> str:
    """Description of how an unresponsive worker ended."""
    try:
        status = popen.wait(LEAVING)
    except subprocess.TimeoutExpired:
        return "closed its pipe"
    killed = ": it was ended from outside. Is there too little memory? Try fewer workers (`--workers`)"
    return f"died with exit status {status}{killed if status == -signal.SIGKILL else ''}"


def _end(processes: list[WorkerProcess], owner: int) -> None:
    if os.getpid() != owner:
        return
    for process in processes:
        process.connection.close()
    deadline = time.monotonic() + LEAVING
    for process in processes:
        try:
            process.popen.wait(max(deadline - time.monotonic(), 0.0))
        except subprocess.TimeoutExpired:
            process.popen.kill()
            process.popen.wait()
        os.close(process.log)
    processes.clear()
