"""The live table of a run on a terminal."""

from collections.abc import Callable, Sequence
from itertools import pairwise

from rich.console import Console, Group
from rich.constrain import Constrain
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from iowbc.pipeline.console.display import Display, StageView
from iowbc.pipeline.console.wording import duration, pace

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
