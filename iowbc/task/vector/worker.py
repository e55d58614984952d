"""A worker process: builds its environments, then answers calls until its parent is gone."""

import contextlib
import faulthandler
import gc
import os
import pickle
import signal
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from iowbc.errors import IowbcError
from iowbc.processes import die_with_parent

ASKED = "import json, sys; sys.path[:] = json.loads(sys.argv.pop(1)); from iowbc.task.vector.worker import main; main()"
"""Python program of a worker process. Its arguments are the parent's module path, as JSON, and its process id; whether
to die with the thread that started the worker; and the descriptors of pipe, shared memory and log."""


@dataclass(frozen=True)
class Message:
    """A call of a method of a group's environments, wherever they are stepped."""

    method: Callable[..., Any]
    arguments: tuple[Any, ...] = ()
    changes: bool = True
    """True if the call changes the environments' state."""

    def carry_out(self, batch: Any) -> Any:
        """Executes the call for a group of environments."""
        return self.method(batch, *self.arguments)


def main() -> None:
    """Entry point of the process; see `iowbc.task.vector.workers` for the other end."""
    parent, bound, pipe, memory, log = (int(argument) for argument in sys.argv[1:])
    for ignored in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    die_with_parent(parent, bound=bool(bound))
    with contextlib.suppress(OSError):  # a worker that wakes must not keep its parent from waking the others
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    file = os.fdopen(log, "w")
    faulthandler.enable(file=file)
    faulthandler.register(signal.SIGUSR1, file=file)
    connection = Connection(pipe)
    try:
        _serve(connection, memory)
    finally:  # also where the parent has gone
        connection.close()
        file.flush()
        os._exit(0)


def _serve(connection: Connection, memory: int) -> None:
    try:
        from iowbc.task.vector.shared import attach_shared

        setup, first, last = connection.recv()
        batch = setup.batch(first, last, attach_shared(memory, setup.buffer_fields(), setup.count).rows(first, last))
        gc.freeze()  # permanent objects need not be scanned at every collection
        connection.send((True, None))
        while True:
            message: Message = connection.recv()
            connection.send_bytes(pickle.dumps((True, message.carry_out(batch))))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        raise
    except IowbcError as error:
        connection.send((False, str(error)))
    except BaseException:
        connection.send((False, traceback.format_exc()))
