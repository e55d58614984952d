"""Ctrl-C before a run has begun, or in any other command."""

import os
import signal
import sys
from types import FrameType

INTERRUPTED = 130
"""Exit code of what was interrupted."""
IMPORTS = "importlib._bootstrap"
"""Module whose code is on the stack while a module is being read."""


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
