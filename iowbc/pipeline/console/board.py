"""Many runs on the console: the state of each, and the last line of its log."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from iowbc.pipeline.console.display import STYLES, StageView
from iowbc.pipeline.console.wording import duration

TAIL = 4096
"""Bytes of a log in which its last line is looked for."""
REDRAW = 0.5
"""Seconds between two drawings of the live table."""
LAST_SHOWN = 5
"""Runs that have ended and are still shown in the live table."""


@dataclass
class Board:
    """Shows many runs: a table on a terminal, lines elsewhere."""

    console: Console
    logs: Mapping[str, Path]
    """Log of the output of each run, by its name."""
    interval: float
    """Seconds between two lines of progress where the output is not a terminal."""
    quiet: bool = False
    stopping: Callable[[], str] = lambda: ""
    """Text about a requested stop; empty before."""
    _over: list[StageView] = field(default_factory=list)
    """Ended runs, in order of their end."""
    _shown: float = field(default_factory=time.monotonic)

    def __post_init__(self) -> None:
        self.views = {name: StageView(name) for name in self.logs}
        live = self.console.is_terminal and not self.quiet
        self.live = Live(console=self.console, get_renderable=self._drawn, auto_refresh=False) if live else None
        """The live table; a context manager to hold during the runs."""

    def began(self, name: str) -> None:
        view = self.views[name]
        view.state, view.began = "runs", time.monotonic()
        self._say(f"{name}: runs, log {self.logs[name]}")

    def ended(self, name: str, state: str, note: str) -> None:
        """A run has ended: `done`, `failed` or `stopped`."""
        view = self.views[name]
        view.state, view.note, view.seconds = state, note, view.spent
        self._over.append(view)
        took = f" in {duration(view.seconds)}" if view.seconds is not None else ""
        self._say(f"{name}: {state}{took}{f' - {note}' if note else ''} ({self._counts()})", lost=state == "failed")

    def refresh(self) -> None:
        """Show the runs' progress if the last display is older than the interval."""
        now = time.monotonic()
        if self.live is not None and now - self._shown > REDRAW:
            self._shown = now
            self.live.refresh()
        elif self.live is None and now - self._shown > self.interval:
            self._shown = now
            for view in self.views.values():
                if view.state == "runs":
                    self._say(f"{view.name}: {last_line(self.logs[view.name])}")

    def _say(self, text: str, *, lost: bool = False) -> None:
        if self.live is None and (lost or not self.quiet):
            self.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def _counts(self) -> str:
        """`3 of 10 done, 1 failed`."""
        states = [view.state for view in self.views.values()]
        parts = [f"{states.count(state)} {state}" for state in ("failed", "stopped") if state in states]
        return ", ".join([f"{states.count('done')} of {len(states)} done", *parts])

    def _drawn(self) -> Group:
        table = Table(box=None, padding=(0, 1, 0, 0))
        for name, width in {"run": 12, "state": 7, "spent": 9, "says": None}.items():
            table.add_column(name, min_width=width, no_wrap=True, overflow="ellipsis")
        running = [view for view in self.views.values() if view.state == "runs"]
        for view in (*self._over[-LAST_SHOWN:], *running):
            text = view.note or (last_line(self.logs[view.name]) if view.state == "runs" else "")
            state = Text(view.state, style=STYLES.get(view.state, ""))
            table.add_row(Text(view.name), state, duration(view.spent), Text(text, style="dim"))
        stopping = self.stopping()
        return Group(table, Text(self._counts()), *([Text(stopping, style="magenta")] if stopping else []))


def last_line(log: Path) -> str:
    """The last line of a log that says anything; empty where there is none."""
    try:
        with log.open("rb") as file:
            file.seek(max(0, log.stat().st_size - TAIL))
            lines = file.read().decode(errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.strip() for line in reversed(lines) if line.strip()), "")
