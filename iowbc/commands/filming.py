"""How far a film is: a bar on a terminal, a line once in a while elsewhere."""

import time
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import Progress, TaskID

from iowbc.commands.printed import tell

INTERVAL = 10.0
"""Seconds between two lines."""


class Filming:
    """Tells how much of a film is drawn; nothing where there is no film."""

    def __init__(self, console: Console, film: Path | None) -> None:
        self.console, self.film = console, film
        self._bar = Progress(console=console, transient=True) if film and console.is_terminal else None
        self._task: TaskID | None = None
        self._said = time.monotonic()

    def __call__(self, seconds: float, duration: float) -> None:
        """So much of the film is drawn, of so much [s]."""
        if self._bar is not None:
            if self._task is None:
                self._task = self._bar.add_task(str(self.film), total=duration)
            self._bar.update(self._task, completed=seconds)
        elif self.film is not None and time.monotonic() - self._said >= INTERVAL:
            self._said = time.monotonic()
            tell(self.console, f"{self.film}: {seconds:.0f} of {duration:.0f} s")

    def __enter__(self) -> Self:
        if self.film is not None:
            tell(self.console, f"{self.film}: sets up the simulation")
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()
