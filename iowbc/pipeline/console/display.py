"""Displays of a run: the state of each stage, and plain lines for logs."""

import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import IO

from iowbc.pipeline.console.wording import duration, pace
from iowbc.pipeline.store.workspace import Progress

RATE_WINDOW = 60.0
"""Seconds over which a stage's rate is averaged."""
CURVE_POINTS = 200
"""Maximum number of points of a stage's sparkline."""


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
