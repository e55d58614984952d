"""The run that MLflow shows above those of a sweep's points."""

import contextlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from iowbc.pipeline.store.digests import data_digest
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.tracker import (
    DESCRIPTION,
    PARENT,
    Sender,
    cleaned,
    new_journal,
    parameters,
    process_tags,
    unfinished_journal,
)


class Family:
    """Records a sweep; its points record themselves as runs within it. One that did not finish is continued."""

    def __init__(
        self, runs: Runs, name: str, experiment: str, settings: Mapping[str, Mapping[str, object]], patience: float
    ) -> None:
        """settings: of each point by its name. patience: time that MLflow has at the end to take everything [s]."""
        self.runs = runs
        self.patience = patience
        self._sender = Sender(runs)
        digest = data_digest({"sweep": name, "points": {point: dict(varied) for point, varied in settings.items()}})
        journal = unfinished_journal(runs, name, digest)
        if journal is None:
            journal = new_journal(runs, name, experiment, digest)
            params = parameters({"sweep": name, "points": len(settings), **_axes(settings)})
            journal.write("run", id=PARENT, parent=None, name=name, tags=process_tags(), params=params)
        self._journal = journal

    @property
    def origin(self) -> str:
        """By which other journals name this run."""
        return f"{self._journal.path.stem}/{PARENT}"

    def send(self) -> None:
        """See to it that a sender is at work."""
        self._sender.start()

    def describe(self, text: str, figures: Mapping[str, float], files: Sequence[Path]) -> None:
        """What came out: Markdown, numbers by name, and files below `runs`."""
        self._journal.write("tags", id=PARENT, tags={DESCRIPTION: text})
        if figures:
            self._journal.write("metrics", id=PARENT, values=cleaned(figures), step=0)
        self._journal.write("files", id=PARENT, paths=[os.path.relpath(path, self.runs.root) for path in files])

    def close(self, status: str) -> bool:
        """End the run with MLflow's status; True where MLflow has everything."""
        path = self._journal.path
        with contextlib.suppress(OSError):  # the sweep has ended as it did, whether or not that can be written
            self._journal.write("end", id=PARENT, status=status)
        self._journal.close()
        self.send()
        return self._sender.took(path, self.patience if status != "KILLED" else 0.0)


def _axes(settings: Mapping[str, Mapping[str, object]]) -> dict[str, str]:
    """All values of each path that is varied, in order of appearance."""
    found: dict[str, dict[str, None]] = {}
    for varied in settings.values():
        for path, value in varied.items():
            found.setdefault(path, {})[str(value)] = None
    return {path: ", ".join(values) for path, values in found.items()}
