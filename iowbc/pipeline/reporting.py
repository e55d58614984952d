"""A stage's report: to the console, to the tracking journal, and to its record on disk."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from iowbc.pipeline.console.display import Display, StageView
from iowbc.pipeline.store.workspace import Workspace
from iowbc.pipeline.tracking.tracker import Tracker


@dataclass
class StageReport:
    """Implements the `Report` that a stage receives."""

    view: StageView
    display: Display
    tracker: Tracker | None
    workspace: Workspace

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        """Record named values at a step; the first name is the stage's main metric."""
        if not values:
            return
        name = self.view.metric if self.view.metric in values else next(iter(values))
        self.view.measured(name, step, float(values[name]))
        self.workspace.drawn(self.view.metric, self.view.curve)
        if self.tracker is not None:
            self.tracker.metrics(self.view.name, values, step)
        self.display.moved(self.view)

    def progress(self, done: float, total: float, note: str = "") -> None:
        self.view.progress(done, total, note)
        self.workspace.progress(done, total, note)
        self.display.moved(self.view)

    def files(self, path: Path) -> None:
        if self.tracker is not None:
            self.tracker.files(self.view.name, [path])

    def say(self, text: str) -> None:
        prefix = f"{self.view.name}: "
        self.display.say(prefix + text.removeprefix(prefix))
