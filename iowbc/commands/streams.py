"""What a command prints to: any character can be written, and a run goes on when nobody can read it any more."""

import errno
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

from iowbc.full_disk import FULL

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

GONE = (errno.EIO, errno.EPIPE, *FULL)
"""Errors of a terminal or reader that has gone away, and of a file that takes no more."""
STANDARD_OUTPUT = 1


def prepare_streams() -> None:
    """Let every text be written somehow: characters that the terminal does not know, and streams that are closed."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open("/dev/null", "w", encoding="utf-8"))  # noqa: SIM115 (for the whole process)
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def let_go() -> None:
    """Drop what the ends of the streams do not take any more, before Python tries to write it once again."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _lead_to_nowhere(stream.fileno())


@contextmanager
def outlasting_readers() -> Iterator[None]:
    """Inside, what cannot be written any more is dropped: a lost terminal or a full log file does not end a run."""
    former = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = map(_outlasting, former)
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = former


def _outlasting(stream: TextIO) -> TextIO:
    stream.flush()
    buffer = io.BufferedWriter(_Outlasting(stream.fileno(), "wb", closefd=False))
    return io.TextIOWrapper(buffer, encoding=stream.encoding, errors="replace", line_buffering=True)


class _Outlasting(io.FileIO):
    """Leads to nowhere from the first write on that fails because the other end is gone or full."""

    def write(self, data: "ReadableBuffer", /) -> int:
        try:
            return super().write(data) or 0
        except OSError as error:
            if error.errno not in GONE:
                raise
            _lead_to_nowhere(self.fileno())
            if error.errno in FULL and self.fileno() == STANDARD_OUTPUT:
                print(f"what is printed cannot be written any more: {error.strerror}; the run goes on", file=sys.stderr)
            return memoryview(data).nbytes


def _lead_to_nowhere(descriptor: int) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)
