"""A command as a process: exit codes, signals outside of a run, output streams, unexpected errors."""

import errno
import io
import os
import shlex
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from iowbc.full_disk import FULL, is_disk_full, what_is_full

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

    from iowbc.pipeline.store.artifact import Artifact

DONE, STAGE_FAILED, INTERRUPTED = 0, 1, 130
"""Exit codes."""
NOT_BEGUN = 256
"""Code of a run that never began; exit codes are 0 to 255, or a negative signal number."""
GONE = (errno.EIO, errno.EPIPE, *FULL)
"""Errors of a closed terminal or pipe, and of a full disk."""
STANDARD_OUTPUT = 1


@dataclass(frozen=True)
class RunEnding:
    """The end of one run."""

    code: int
    failure: str = ""
    """The stage that failed and the reason, in a line; empty where none did."""
    artifacts: "Mapping[str, Artifact]" = field(default_factory=dict)
    """By stage: what the run made or found, if it is done."""

    @property
    def state(self) -> str:
        """`done`, `stopped`, `waits`, or `failed`."""
        return {DONE: "done", INTERRUPTED: "stopped", NOT_BEGUN: "waits"}.get(self.code, "failed")


def close_on_termination() -> None:
    """Make SIGTERM and SIGHUP end the command as Ctrl-C does, closing open resources."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.getsignal(signal.SIGINT))


def leave(number: int, frame: FrameType | None) -> None:
    """Signal handler: end the command by `SystemExit`, so that open resources are closed; during an import, which could
    swallow or disguise that exception, end the process at once instead."""
    while frame is not None:
        if frame.f_globals.get("__name__") == "importlib._bootstrap":
            os._exit(INTERRUPTED)
        frame = frame.f_back
    sys.exit(INTERRUPTED)


def prepare_streams() -> None:
    """Make every text printable: replace characters that the terminal lacks, and closed streams by the null device."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open("/dev/null", "w", encoding="utf-8"))  # noqa: SIM115 (for the whole process)
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def require_text(words: Sequence[str]) -> None:
    """Raises `UsageError` for an argument in another encoding, which records and printed commands could not repeat."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            from iowbc.errors import UsageError

            raise UsageError(f"{word!r} is not {sys.getfilesystemencoding()} text; rename what it names") from None


def let_go() -> None:
    """Discard output that cannot be written any more, before Python tries again at exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _redirect_to_devnull(stream.fileno())


@contextmanager
def ignoring_broken_outputs() -> Iterator[None]:
    """Discard output that cannot be written: inside the block, a closed terminal or a full disk does not end a run."""
    former = sys.stdout, sys.stderr
    for stream in former:
        stream.flush()
    sys.stdout, sys.stderr = (
        io.TextIOWrapper(
            io.BufferedWriter(_ForgivingFile(stream.fileno(), "wb", closefd=False)),
            encoding=stream.encoding,
            errors="replace",
            line_buffering=True,
        )
        for stream in former
    )
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = former


class _ForgivingFile(io.FileIO):
    """File that switches to the null device when a write fails because the reader is gone or the disk is full."""

    def write(self, data: "ReadableBuffer", /) -> int:
        try:
            return super().write(data) or 0
        except OSError as error:
            if error.errno not in GONE:
                raise
            _redirect_to_devnull(self.fileno())
            if error.errno in FULL and self.fileno() == STANDARD_OUTPUT:
                print(f"what is printed cannot be written any more: {error.strerror}; the run goes on", file=sys.stderr)
            return memoryview(data).nbytes


def _redirect_to_devnull(descriptor: int) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)


def described(error: Exception, arguments: Sequence[str]) -> str:
    """Message of an unexpected error: a summary, the file with the details or else these, and the next command."""
    again = f"to go on: {shlex.join(['iowbc', *arguments])}"
    if is_disk_full(error):
        full = what_is_full(error, (Path("runs"), Path(os.environ.get("TMPDIR", "/tmp"))))
        return f"no space is left: {full}; make some (`iowbc gc` removes what you name), and then\n{again}"
    summary = " ".join(f"{type(error).__name__}: {error}".split())[:300]
    details = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile("w", prefix="iowbc-", suffix=".txt", delete=False, encoding="utf-8") as file:
            file.write(details)
        where = f"the details are in {file.name}"
    except OSError:
        where = f"the details could not be written:\n{details.rstrip()}"
    return f"unexpected error: {summary}; {where}\n{again}"
