"""Records of runs: written to a journal at once, sent by a process of its own, so that no run waits for a server."""

import contextlib
import os
import re
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from socket import gethostname
from typing import Any

from iowbc.files import data_digest
from iowbc.pipeline.nested import flattened
from iowbc.pipeline.store.artifact import INGREDIENTS, RECIPE, Artifact
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.delivery import tracking_uri
from iowbc.pipeline.tracking.journal import PARENT, Journal, header, statuses, unsent
from iowbc.processes import SINGLE_THREADED
from iowbc.recipe.execution import Execution
from iowbc.recipe.reading.loading import LoadedRecipe
from iowbc.recipe.sweep import Sweep

SHOWN_FOLDERS = ("figures", "tables", "videos")
"""Folders of an artifact that go to MLflow."""
CHECKING_TIME = 1.0
"""Time limit for acquiring a journal's lock, which a sender holds briefly [s]."""
DESCRIPTION = "mlflow.note.content"
"""Tag that MLflow shows as a run's description."""


class RunRecord:
    """A run in its journal, and the process that sends the journal to MLflow."""

    def __init__(self, runs: Runs, journal: Journal | None, patience: float = 0.0) -> None:
        """journal: None for one that begins later. patience: time that MLflow has at the end to take everything [s]."""
        self.runs, self.patience = runs, patience
        self._open = journal
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def _journal(self) -> Journal:
        assert self._open is not None
        return self._open

    @property
    def origin(self) -> str:
        """The run's name in other journals."""
        return f"{self._journal.path.stem}/{PARENT}"

    def send(self) -> None:
        """Start a sender where none is at work."""
        if self._process is None or self._process.poll() is not None:
            with contextlib.suppress(OSError):  # the next run's sender will send the journal
                self._process = start_sender(self.runs)

    def describe(self, text: str, figures: Mapping[str, float] | None = None, files: Sequence[Path] = ()) -> None:
        """Add a description in Markdown, numbers by name, and files below `runs`; of a run that has begun."""
        if self._open is None:
            return
        if text:
            self._journal.write("tags", id=PARENT, tags={DESCRIPTION: text})
        if figures:
            self.metrics(PARENT, figures, 0)
        if files:
            self.files(PARENT, files)

    def metrics(self, name: str, values: Mapping[str, float], step: int) -> None:
        """Values of a run at a step, under names that MLflow accepts."""
        cleaned = {re.sub(r"[^\w\-. :/]", "_", known): float(value) for known, value in values.items()}
        self._journal.write("metrics", id=name, values=cleaned, step=step)

    def close(self, status: str, *, wait: bool = True) -> bool:
        """End the run with MLflow's status and let the sender deliver the rest. Returns True if MLflow has all."""
        if self._open is None:
            return True
        path = self._open.path
        with contextlib.suppress(OSError):  # a full disk must not change how the run ends
            self._open.write("end", id=PARENT, status=status)
        self._open.close()
        self.send()
        limit = time.monotonic() + (self.patience if wait else 0.0)
        while unsent(path) and time.monotonic() <= limit:
            if self._process is not None and self._process.poll() is not None:
                break
            time.sleep(0.05)
        return not unsent(path)

    def files(self, name: str, paths: Sequence[Path]) -> None:
        """Files and folders below `runs` of a run; a folder's further files follow when it is reported again."""
        self._journal.write("files", id=name, paths=[os.path.relpath(path, self.runs.root) for path in paths])


class Tracker(RunRecord):
    """Records one recipe run and its stages. A run of the same recipe that did not finish is continued."""

    def __init__(self, runs: Runs, loaded: LoadedRecipe, within: str | None = None) -> None:
        """within: parent run in another journal, whose process also starts the sender."""
        self.within = within
        self._recipe = loaded.recipe
        self._resolved = loaded.recipe.model_dump(mode="json")
        journal = unfinished_journal(runs, self._recipe.name, data_digest(self._resolved))
        super().__init__(runs, journal, loaded.recipe.execution.tracking_patience)

    def send(self) -> None:
        if self.within is None:
            super().send()

    def stage(
        self, name: str, key: str, slices: Mapping[str, Any], resumed: bool, before: Mapping[str, Artifact]
    ) -> None:
        """A stage begins to run, or goes on; `slices` is its part of the recipe. `before`: the artifacts of the stages
        before it. A run is recorded only once a stage of it runs."""
        if self._open is None:
            experiment, params = self._recipe.execution.experiment, parameters(self._resolved)
            digest = data_digest(self._resolved)
            self._open = new_journal(self.runs, self._recipe.name, experiment, digest, params, self.within)
            for cached, artifact in before.items():
                self.finished(cached, artifact, cached=True)
        tags = {**process_tags(), "iowbc.stage": name, "iowbc.key": key, "iowbc.cached": "false"}
        if resumed and name in statuses(self._journal.path):
            self._journal.write("reopen", id=name, tags={**tags, "iowbc.resumed": "true"})
        else:
            self._journal.write("run", id=name, parent=PARENT, name=name, tags=tags, params=parameters(slices))
        self.send()

    def end(self, name: str, status: str, message: str = "") -> None:
        """A stage that ran has ended with MLflow's status FAILED or KILLED."""
        if message:
            self._journal.write("tags", id=name, tags={"iowbc.message": message})
        self._journal.write("end", id=name, status=status)

    def finished(self, name: str, artifact: Artifact, cached: bool) -> None:
        """A stage has its artifact; a cached one gets a nested run too, where the run makes any."""
        if self._open is None:
            return
        if cached:
            if statuses(self._journal.path).get(name) == "FINISHED":
                return
            tags = {"iowbc.stage": name, "iowbc.key": artifact.manifest.key, "iowbc.cached": "true"}
            self._journal.write("run", id=name, parent=PARENT, name=name, tags=tags, params={})
        self._journal.write("tags", id=name, tags={"iowbc.artifact": str(artifact.folder)})
        if artifact.metrics:
            self.metrics(name, {f"summary/{key}": value for key, value in artifact.metrics.items()}, 0)
            self.metrics(PARENT, {f"{name}/{key}": value for key, value in artifact.metrics.items()}, 0)
        files = [INGREDIENTS, RECIPE] if cached else [INGREDIENTS, RECIPE, *SHOWN_FOLDERS]
        self.files(name, [artifact.folder / file for file in files if (artifact.folder / file).exists()])
        if not cached:
            self.files(PARENT, [artifact.folder / RECIPE])
        self._journal.write("end", id=name, status="FINISHED")


def new_journal(
    runs: Runs, name: str, experiment: str, digest: str, params: Mapping[str, str], within: str | None = None
) -> Journal:
    """Create a journal and start its run; `digest` identifies the work of the run. within: see `Tracker`."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    journal = Journal(runs.tracking / f"{stamp}-{name}-{os.getpid()}.jsonl")
    while not journal.acquire(CHECKING_TIME):
        pass  # a sender looks whether it is of a dead process
    journal.write("journal", uri=tracking_uri(), experiment=experiment, recipe=name, digest=digest)
    journal.write("run", id=PARENT, parent=within, name=name, tags=process_tags(), params=dict(params))
    return journal


def unfinished_journal(runs: Runs, name: str, digest: str) -> Journal | None:
    """The newest journal of the same run if it is unfinished and its process is dead; reopened to continue."""
    paths, same = runs.tracking.glob(f"*-{name}-*.jsonl"), {"digest": digest, "uri": tracking_uri()}
    path = next((path for path in sorted(paths, reverse=True) if same.items() <= header(path).items()), None)
    if path is None or statuses(path).get(PARENT) == "FINISHED":
        return None
    journal = Journal(path)
    if not journal.acquire(CHECKING_TIME):
        journal.close()
        return None
    journal.write("reopen", id=PARENT, tags=process_tags())
    return journal


def sweep_record(runs: Runs, sweep: Sweep, execution: Execution) -> RunRecord:
    """The parent run of a sweep, whose points record themselves; an unfinished one is continued."""
    digest = data_digest({"sweep": sweep.name, "points": {one.name: dict(one.settings) for one in sweep.points}})
    axes = {path: dict.fromkeys(str(one.settings[path]) for one in sweep.points) for path in sweep.axes}
    params = {"sweep": sweep.name, "points": str(len(sweep.points))}
    params |= {path: ", ".join(values) for path, values in axes.items()}
    journal = unfinished_journal(runs, sweep.name, digest)
    journal = journal or new_journal(runs, sweep.name, execution.experiment, digest, params)
    return RunRecord(runs, journal, execution.tracking_patience)


def record_figures(
    runs: Runs, name: str, figures: Mapping[str, float], text: str = "", files: Sequence[Path] = ()
) -> None:
    """Record a run without stages, such as a benchmark: figures by name, its description, and files below `runs`."""
    record = RunRecord(runs, new_journal(runs, name, Execution.model_fields["experiment"].default, "", {}))
    record.describe(text, figures, files)
    record.close("FINISHED")


def parameters(resolved: Mapping[str, Any]) -> dict[str, str]:
    """A resolved recipe as MLflow parameters: dotted path and value as text."""
    return {path: str(value) for path, value in flattened(resolved).items()}


def start_sender(runs: Runs) -> subprocess.Popen[bytes]:
    """Start the process that sends the journals, in a session of its own so that Ctrl-C does not reach it."""
    runs.tracking.mkdir(parents=True, exist_ok=True)
    try:
        log = (runs.tracking / "sender.log").open("ab")
    except OSError:
        log = open(os.devnull, "wb")  # noqa: SIM115 (closed below)
    with log:
        return subprocess.Popen(
            [sys.executable, "-m", "iowbc.pipeline.tracking.delivery", str(runs.root.absolute())],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
            env=os.environ | SINGLE_THREADED,
        )


def backlog(runs: Runs) -> list[Path]:
    """Journals with unsent data."""
    return [path for path in sorted(runs.tracking.glob("*.jsonl")) if unsent(path)]


def process_tags() -> dict[str, str]:
    """Tags by which a run names its process."""
    return {"iowbc.pid": str(os.getpid()), "iowbc.host": gethostname()}
