"""SIGINT, SIGTERM and SIGHUP: the first asks the stage to stop after a checkpoint, the second aborts.

SIGHUP means that the terminal is closed. It never aborts, because it comes twice if a shell forwards it and then ends;
it is ignored in a run started with `nohup`. After the first, later ones are ignored until the process ends: the second
may arrive while the stopped state is being written.
"""

import contextlib
import os
import signal
from types import FrameType
from typing import Self

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class StopRequest:
    """While entered, turns the signals into a flag."""

    def __init__(self, *, shown: bool = False) -> None:
        """shown: `text` is displayed elsewhere, as by the live table, and not written here."""
        self.shown = shown
        self.signal: signal.Signals | None = None
        self._afterwards: dict[signal.Signals, object] = {}

    def __call__(self) -> bool:
        """True once a stop is requested."""
        return self.signal is not None

    @property
    def text(self) -> str:
        """The request, and how to abort; empty before."""
        if self.signal is None:
            return ""
        return f"{self.signal.name}: stopping at the next checkpoint; once more to abort at once"

    def __enter__(self) -> Self:
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                self._afterwards[number] = signal.signal(number, self._received)
        return self

    def __exit__(self, *reason: object) -> None:
        for number, action in self._afterwards.items():
            signal.signal(number, action)  # type: ignore[arg-type]

    def _received(self, number: int, frame: FrameType | None) -> None:
        """Writes past Python's buffers, which the interrupted code may be using."""
        if number == signal.SIGHUP:
            self._afterwards[signal.SIGHUP] = signal.SIG_IGN
            if self.signal is not None:
                return
        if self.signal not in (None, signal.SIGHUP):
            self._write("aborting")
            raise KeyboardInterrupt
        self.signal = signal.Signals(number)
        self._write(self.text)

    def _write(self, text: str) -> None:
        if not self.shown:
            with contextlib.suppress(OSError):  # the terminal may be closed
                os.write(2, f"\n{text}\n".encode())
