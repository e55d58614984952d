"""A stage's report: to the console, to the tracking journal, and to its record on disk."""

from collections.abc import Mapping
from pathlib import Path

from iowbc.pipeline.console.display import Display, StageView
from iowbc.pipeline.store.workspace import Workspace
from iowbc.pipeline.tracking.tracker import Tracker


class StageReport:
    """Implements the `Report` that a stage receives."""

    def __init__(self, view: StageView, display: Display, tracker: Tracker | None, workspace: Workspace) -> None:
        self._view = view
        self._display = display
        self._tracker = tracker
        self._workspace = workspace

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        """Record named values at a step; the first name is the stage's main metric."""
        if not values:
            return
        name = self._view.metric if self._view.metric in values else next(iter(values))
        self._view.measured(name, step, float(values[name]))
        self._workspace.drawn(self._view.metric, self._view.curve)
        if self._tracker is not None:
            self._tracker.metrics(self._view.name, values, step)
        self._display.moved(self._view)

    def progress(self, done: float, total: float, note: str = "") -> None:
        self._view.progress(done, total, note)
        self._workspace.progress(done, total, note)
        self._display.moved(self._view)

    def files(self, path: Path) -> None:
        if self._tracker is not None:
            self._tracker.files(self._view.name, path)

    def say(self, text: str) -> None:
        prefix = f"{self._view.name}: "
        self._display.say(prefix + text.removeprefix(prefix))
