"""Displays of a run: the state of each stage, as plain lines for logs, or as a live table on a terminal."""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import IO

from rich.console import Console, Group
from rich.constrain import Constrain
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from iowbc.pipeline.console.wording import duration, pace
from iowbc.pipeline.store.workspace import Progress

RATE_WINDOW = 60.0
"""Seconds over which a stage's rate is averaged."""
CURVE_POINTS = 200
"""Maximum number of points of a stage's sparkline."""
BLOCKS = "▁▂▃▄▅▆▇█"
CURVE_WIDTH = 24
COLUMNS = {"stage": 10, "state": 7, "": 14, "done": 5, "spent": 11, "left": 11, "rate": 9}
"""Heads and widths of what is always shown: 74 characters with the spaces between them."""
WITH_CURVES, WITH_NOTES = 100, 60
"""Minimum width of a terminal [characters] for curves, and for notes."""
ECHO = 2
"""Characters that a terminal writes behind the last line where Ctrl-C is typed: `^C`."""
REFRESH_RATE = 2.0
"""Redraws a second; each takes a moment from the stage."""
STYLES = {
    "waits": "dim",
    "cached": "cyan",
    "runs": "bold yellow",
    "done": "green",
    "failed": "bold red",
    "stopped": "magenta",
}


@dataclass
class StageView:
    """State of a stage while a recipe runs."""

    name: str
    state: str = "waits"
    note: str = ""
    record: Progress = field(default_factory=Progress)
    """Progress and curve of the main metric, the first one reported. The same object as `Workspace.state`."""
    began: float | None = None
    """Start on the monotonic clock, shifted back by the time of earlier attempts [s]; None before it runs."""
    seconds: float | None = None
    """Time that it took in all [s]; None before it has ended."""
    _marks: deque[tuple[float, float]] = field(default_factory=deque)

    def progress(self, done: float, total: float, note: str) -> None:
        """The stage is at `done` of `total`, in units of its own."""
        moment = time.monotonic()
        if done < self.record.done or total != self.record.total:
            self._marks.clear()
        self.record.done, self.record.total, self.note = done, total, note
        self._marks.append((moment, done))
        while len(self._marks) > 2 and moment - self._marks[0][0] > RATE_WINDOW:
            self._marks.popleft()

    def measured(self, metric: str, step: float, value: float) -> None:
        """Add the main metric's value at a step. Values of an earlier attempt from this step on are dropped; a long
        curve is thinned to every second value."""
        self.record.metric, curve = self.record.metric or metric, self.record.curve
        while curve and curve[-1][0] >= step:
            curve.pop()
        curve.append((step, value))
        if len(curve) > CURVE_POINTS:
            del curve[1::2]

    @property
    def values(self) -> list[float]:
        return [value for _, value in self.record.curve]

    @property
    def spent(self) -> float | None:
        """Time over all attempts until now, or until its end [s]; None before it runs."""
        if self.seconds is not None:
            return self.seconds
        return None if self.began is None else time.monotonic() - self.began

    @property
    def rate(self) -> float | None:
        """Units per second over the last `RATE_WINDOW`."""
        if len(self._marks) < 2 or self._marks[-1][0] - self._marks[0][0] <= 0.0:
            return None
        return (self._marks[-1][1] - self._marks[0][1]) / (self._marks[-1][0] - self._marks[0][0])

    @property
    def left(self) -> float | None:
        """Time until the stage is done at the present rate [s]."""
        rate, record = self.rate, self.record
        return (record.total - record.done) / rate if rate and rate > 0.0 and record.total else None

    @property
    def share(self) -> float:
        """Part that is done, 0 to 1."""
        return min(1.0, self.record.done / self.record.total) if self.record.total else 0.0


class Display:
    """Display of a run; this one shows nothing."""

    def begin(self, views: Sequence[StageView]) -> None:
        """Start to show these stages."""

    def changed(self, view: StageView) -> None:
        """A stage changed its state: shown at once."""

    def moved(self, view: StageView) -> None:
        """A stage made progress: shown now and then."""

    def say(self, text: str) -> None:
        """One line."""

    def end(self) -> None:
        """End the display."""


class PlainDisplay(Display):
    """Lines for logs: each change of state, and progress once in a while."""

    def __init__(self, interval: float, stream: IO[str]) -> None:
        """interval: seconds between two lines of progress."""
        self.interval, self.stream = interval, stream
        self._last = time.monotonic()

    def changed(self, view: StageView) -> None:
        spent = f" in {duration(view.seconds)}" if view.seconds is not None else ""
        self.say(f"{view.name}: {view.state}{spent}{' - ' + view.note if view.note else ''}")
        self._last = time.monotonic()

    def moved(self, view: StageView) -> None:
        if time.monotonic() - self._last < self.interval:
            return
        self._last = time.monotonic()
        parts = [f"{view.name}: {100 * view.share:.0f} %"]
        if view.rate is not None:
            parts.append(pace(view.rate))
        if view.left is not None:
            parts.append(f"{duration(view.left)} left")
        if view.values:
            parts.append(f"{view.record.metric} {view.values[-1]:.4g}")
        self.say("  ".join([*parts, view.note] if view.note else parts))

    def say(self, text: str) -> None:
        print(text, file=self.stream, flush=True)


def sparkline(values: Sequence[float], width: int = CURVE_WIDTH) -> str:
    """A curve in one line of block characters: means of equal parts, scaled between the smallest and the largest."""
    finite = [value for value in values if value == value and abs(value) != float("inf")]
    if not finite:
        return ""
    count = min(width, len(finite))
    edges = [index * len(finite) // count for index in range(count + 1)]
    means = [sum(finite[a:b]) / (b - a) for a, b in pairwise(edges)]
    low, high = min(means), max(means)
    scale = (len(BLOCKS) - 1) / (high - low) if high > low else 0.0
    return "".join(BLOCKS[round((mean - low) * scale)] for mean in means)


class LiveTable(Display):
    """One row a stage, redrawn in place, with what the stages note beneath; lines that are said scroll by above it."""

    def __init__(self, console: Console, stopping: Callable[[], str] = lambda: "") -> None:
        """stopping: text about a requested stop; empty before."""
        self.console = console
        self._stopping = stopping
        self._views: Sequence[StageView] = ()
        self._live = Live(console=console, get_renderable=self._drawn, refresh_per_second=REFRESH_RATE)

    def begin(self, views: Sequence[StageView]) -> None:
        self._views = views
        self._live.start()

    def changed(self, view: StageView) -> None:
        self._live.refresh()

    def say(self, text: str) -> None:
        self.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def end(self) -> None:
        self._live.stop()

    def _drawn(self) -> Constrain:
        width = self.console.width
        notes = [
            Text(f"{view.name}: {view.note}", style="dim", no_wrap=True, overflow="ellipsis")
            for view in self._views
            if view.note and width >= WITH_NOTES
        ]
        stopping = [Text(self._stopping(), style="magenta")] if self._stopping() else []
        return Constrain(Group(self._table(width), *notes, *stopping), width - ECHO)

    def _table(self, width: int) -> Table:
        table = Table(box=None, padding=(0, 1, 0, 0), expand=False)
        for name, characters in COLUMNS.items():
            table.add_column(name, width=characters, no_wrap=True, overflow="ellipsis")
        room = width - ECHO - sum(COLUMNS.values()) - len(COLUMNS) - 1
        if width >= WITH_CURVES:
            table.add_column("curve", width=room, no_wrap=True, overflow="ellipsis")
        for view in self._views:
            row = _row(view)
            table.add_row(*row, _curve(view, room)) if width >= WITH_CURVES else table.add_row(*row)
        return table


def _row(view: StageView) -> tuple[Text | ProgressBar | str, ...]:
    """The cells of `COLUMNS`."""
    state = Text(view.state, style=STYLES.get(view.state, ""))
    if view.state != "runs":
        return Text(view.name), state, "", "", duration(view.spent), "", ""
    bar = ProgressBar(total=1.0, completed=view.share, width=COLUMNS[""], pulse=not view.record.total)
    done = f"{100 * view.share:.0f} %" if view.record.total else ""
    left = "finishing" if view.share == 1.0 else duration(view.left)
    return Text(view.name), state, bar, done, duration(view.spent), left, pace(view.rate)


def _curve(view: StageView, room: int) -> Text:
    """The small curve with its name and last value, in so many characters."""
    if not view.values:
        return Text("")
    label = f"{view.record.metric} {view.values[-1]:.4g}"
    return Text(f"{sparkline(view.values, max(4, min(CURVE_WIDTH, room - len(label) - 1)))} {label}")
