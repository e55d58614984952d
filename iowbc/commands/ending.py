"""Endings of commands: exit codes and the handling of Ctrl-C outside of a run."""

import os
import signal
import sys
from dataclasses import dataclass
from types import FrameType

DONE, STAGE_FAILED, INTERRUPTED = 0, 1, 130
"""Exit codes."""
IMPORTS = "importlib._bootstrap"
"""Module whose code is on the stack while a module is being read."""


@dataclass(frozen=True)
class RunEnding:
    """Of one run."""

    code: int
    failure: str = ""
    """Which stage failed and why, in a line; empty where none did."""


def close_on_termination() -> None:
    """From now on a termination, or a lost terminal, closes what is open, as Ctrl-C does."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.getsignal(signal.SIGINT))


def leave(number: int, frame: FrameType | None) -> None:
    """End the command: by `SystemExit`, so that what is open is closed.

    While a module is being read that would reach its caller as an error of that module, if at all; then the process
    ends at once.
    """
    while frame is not None:
        if frame.f_globals.get("__name__") == IMPORTS:
            os._exit(INTERRUPTED)
        frame = frame.f_back
    sys.exit(INTERRUPTED)
