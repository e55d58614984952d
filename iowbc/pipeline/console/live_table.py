"""The live table of a run on a terminal."""

from collections.abc import Sequence
from itertools import pairwise

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from iowbc.pipeline.console.display import StageView
from iowbc.pipeline.console.wording import duration

BLOCKS = "▁▂▃▄▅▆▇█"
CURVE_WIDTH = 24
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


class LiveTable:
    """One row a stage, redrawn in place; lines that are said scroll by above it."""

    def __init__(self, console: Console) -> None:
        self.console = console
        self._views: Sequence[StageView] = ()
        self._live = Live(console=console, get_renderable=self._table, refresh_per_second=REFRESH_RATE)

    def begin(self, views: Sequence[StageView]) -> None:
        """Start to show these stages."""
        self._views = views
        self._live.start()

    def changed(self, view: StageView) -> None:
        """A stage changed its state: shown at once."""
        self._live.refresh()

    def moved(self, view: StageView) -> None:
        """A stage made progress: the next redraw shows it."""

    def say(self, text: str) -> None:
        """One line."""
        self.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def end(self) -> None:
        """Nothing more comes."""
        self._live.stop()

    def _table(self) -> Table:
        table = Table(box=None, padding=(0, 1), expand=False)
        for name in ("stage", "state", "", "rate", "time", "curve", "note"):
            table.add_column(name, no_wrap=True, overflow="ellipsis")
        for view in self._views:
            table.add_row(*self._row(view))
        return table

    def _row(self, view: StageView) -> tuple[Text | ProgressBar | str, ...]:
        state = Text(view.state, style=STYLES.get(view.state, ""))
        if view.state != "runs":
            return Text(view.name), state, "", "", duration(view.seconds), self._curve(view), Text(view.note)
        bar = ProgressBar(total=1.0, completed=view.share, width=20, pulse=not view.total)
        rate = f"{view.rate:.4g}/s" if view.rate is not None else ""
        left = f"{duration(view.left)} left" if view.left is not None else ""
        return Text(view.name), state, bar, rate, left, self._curve(view), Text(view.note)

    def _curve(self, view: StageView) -> Text:
        if not view.curve:
            return Text("")
        return Text(f"{sparkline(view.curve)} {view.metric} {view.curve[-1]:.4g}")
