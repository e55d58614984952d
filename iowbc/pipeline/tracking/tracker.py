"""What a run tells MLflow.

It is written to a journal at once; a process of its own sends it, so that nothing here waits for a server.
"""

import contextlib
import os
import re
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from iowbc.pipeline.machine import boot, host
from iowbc.pipeline.nested import flattened
from iowbc.pipeline.store.artifact import INGREDIENTS, RECIPE, Artifact
from iowbc.pipeline.store.digests import data_digest
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.delivery import tracking_uri
from iowbc.pipeline.tracking.journal import Journal, header, statuses, unsent
from iowbc.processes import SINGLE_THREADED
from iowbc.recipe.execution import Execution
from iowbc.recipe.reading.document import as_yaml
from iowbc.recipe.reading.loading import LoadedRecipe

PARENT = "recipe"
"""Identifier of the parent run within a journal; a nested run has its stage's name."""
SHOWN_FOLDERS = ("figures", "tables", "videos")
"""Folders of an artifact that go to MLflow."""
CHECKING_TIME = 1.0
"""Seconds within which a sender that looks at a journal has let go of it again."""
DESCRIPTION = "mlflow.note.content"
"""Tag that MLflow shows as a run's description."""


class Tracker:
    """Records one recipe run and its stages. A run of the same recipe that did not finish is continued."""

    def __init__(self, runs: Runs, loaded: LoadedRecipe, within: str | None = None) -> None:
        """within: the run of another journal above this one, which sees to the sender, too."""
        self.runs = runs
        self.within = within
        self.patience = loaded.recipe.execution.tracking_patience
        self._sender = Sender(runs)
        self._loaded = loaded
        self._cached: list[tuple[str, Artifact]] = []
        """Cached stages of a run that has made nothing yet: it is recorded once it makes something."""
        self._open = self._continued(loaded)

    @property
    def _journal(self) -> Journal:
        """The journal, which begins when it is first needed."""
        if self._open is None:
            self._open = self._begun(self._loaded)
            for name, artifact in self._cached:
                self.finished(name, artifact, cached=True)
        return self._open

    def _begun(self, loaded: LoadedRecipe) -> Journal:
        recipe = loaded.recipe
        resolved = recipe.model_dump(mode="json")
        journal = new_journal(self.runs, recipe.name, recipe.execution.experiment, data_digest(resolved))
        journal.write(
            "run", id=PARENT, parent=self.within, name=recipe.name, tags=process_tags(), params=parameters(resolved)
        )
        journal.write("text", id=PARENT, file=RECIPE, text=as_yaml(recipe))
        return journal

    def _continued(self, loaded: LoadedRecipe) -> Journal | None:
        return unfinished_journal(self.runs, loaded.recipe.name, data_digest(loaded.recipe.model_dump(mode="json")))

    def stage(self, name: str, key: str, slices: Mapping[str, Any], resumed: bool) -> None:
        """A stage begins to run, or goes on; `slices` is its part of the recipe."""
        tags = {**process_tags(), "iowbc.stage": name, "iowbc.key": key, "iowbc.cached": "false"}
        if resumed and name in statuses(self._journal.path):
            self._journal.write("reopen", id=name, tags={**tags, "iowbc.resumed": "true"})
        else:
            self._journal.write("run", id=name, parent=PARENT, name=name, tags=tags, params=parameters(slices))
        self.send()

    def metrics(self, name: str, values: Mapping[str, float], step: int) -> None:
        """Values of a stage at a step."""
        self._journal.write("metrics", id=name, values=cleaned(values), step=step)

    def files(self, name: str, path: Path) -> None:
        """A file or folder of a stage that is still running; a folder's further files follow when it is told again."""
        self._journal.write("files", id=name, paths=[os.path.relpath(path, self.runs.root)])

    def end(self, name: str, status: str, message: str = "") -> None:
        """A stage that ran has ended with MLflow's status FAILED or KILLED."""
        if message:
            self._journal.write("tags", id=name, tags={"iowbc.message": message})
        self._journal.write("end", id=name, status=status)

    def finished(self, name: str, artifact: Artifact, cached: bool) -> None:
        """A stage has its artifact; a cached one gets a nested run too, where the run makes any."""
        if cached and self._open is None:
            self._cached.append((name, artifact))
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
        folder = os.path.relpath(artifact.folder, self.runs.root)
        present = [f"{folder}/{file}" for file in files if (artifact.folder / file).exists()]
        self._journal.write("files", id=name, paths=present)
        self._journal.write("end", id=name, status="FINISHED")

    def describe(self, text: str) -> None:
        """Markdown that MLflow shows with the run."""
        if self._open is not None:
            self._journal.write("tags", id=PARENT, tags={DESCRIPTION: text})

    def close(self, status: str, wait: bool) -> bool:
        """End the parent run and let the sender take what is left; True where MLflow has everything.

        A run that made nothing has nothing to tell.
        """
        if self._open is None:
            return True
        path = self._journal.path
        with contextlib.suppress(OSError):  # the run has ended as it did, whether or not that can be written
            self._journal.write("end", id=PARENT, status=status)
        self._journal.close()
        self.send()
        return self._sender.took(path, self.patience if wait else 0.0)

    def send(self) -> None:
        """See to it that a sender is at work."""
        if self.within is None:
            self._sender.start()


class Sender:
    """The process that sends what the runs of a folder tell; it outlives this one."""

    def __init__(self, runs: Runs) -> None:
        self.runs = runs
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """See to it that one is at work."""
        if self._process is None or self._process.poll() is not None:
            with contextlib.suppress(OSError):  # without a sender the journal waits for that of the next run
                self._process = start_sender(self.runs)

    def took(self, journal: Path, patience: float) -> bool:
        """Wait until MLflow has all of a journal, at most so long [s]; whether it has."""
        limit = time.monotonic() + patience
        while journal.exists() and unsent(journal):
            if time.monotonic() > limit or (self._process is not None and self._process.poll() is not None):
                return not (journal.exists() and unsent(journal))
            time.sleep(0.05)
        return True


def new_journal(runs: Runs, name: str, experiment: str, digest: str) -> Journal:
    """A journal that begins; `digest` is of what its run does."""
    stamp = time.strftime("%Y%m%d-%H%M%S")
    journal = Journal(runs.tracking / f"{stamp}-{name}-{os.getpid()}.jsonl")
    journal.acquire(CHECKING_TIME)
    journal.write("journal", uri=tracking_uri(), experiment=experiment, recipe=name, digest=digest)
    return journal


def unfinished_journal(runs: Runs, name: str, digest: str) -> Journal | None:
    """The newest journal of the same run, where that did not finish and its process is gone; the run goes on."""
    for path in sorted(runs.tracking.glob(f"*-{name}-*.jsonl"), reverse=True):
        first = header(path)
        if first.get("digest") != digest or first.get("uri") != tracking_uri():
            continue
        if statuses(path).get(PARENT) == "FINISHED":
            return None
        journal = Journal(path)
        if journal.acquire(CHECKING_TIME):
            journal.write("reopen", id=PARENT, tags=process_tags())
            return journal
        journal.close()
        return None
    return None


def record_figures(
    runs: Runs, name: str, figures: Mapping[str, float], text: str = "", files: Sequence[Path] = ()
) -> None:
    """Record a run that has no stages, such as a benchmark: its figures by name, Markdown that describes it, and files
    below `runs`."""
    with new_journal(runs, name, Execution.model_fields["experiment"].default, "") as journal:
        journal.write("run", id=PARENT, parent=None, name=name, tags=process_tags(), params={})
        if figures:
            journal.write("metrics", id=PARENT, values=cleaned(figures), step=0)
        if text:
            journal.write("tags", id=PARENT, tags={DESCRIPTION: text})
        if files:
            journal.write("files", id=PARENT, paths=[os.path.relpath(path, runs.root) for path in files])
        journal.write("end", id=PARENT, status="FINISHED")
    start_sender(runs)


def cleaned(values: Mapping[str, float]) -> dict[str, float]:
    """Values under names that MLflow accepts."""
    return {re.sub(r"[^\w\-. :/]", "_", name): float(value) for name, value in values.items()}


def parameters(resolved: Mapping[str, Any]) -> dict[str, str]:
    """A resolved recipe as MLflow parameters: dotted path and value as text."""
    return {path: str(value) for path, value in flattened(resolved).items()}


def start_sender(runs: Runs) -> subprocess.Popen[bytes]:
    """Start the process that sends the journals, in a session of its own so that Ctrl-C does not reach it."""
    runs.tracking.mkdir(parents=True, exist_ok=True)
    with _log(runs) as log:
        return subprocess.Popen(
            [sys.executable, "-m", "iowbc.pipeline.tracking.sender", str(runs.root.absolute())],
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
            env=os.environ | SINGLE_THREADED,
        )


def _log(runs: Runs) -> BinaryIO:
    """What the sender writes to: its log, or nothing where that cannot be written."""
    try:
        return (runs.tracking / "sender.log").open("ab")
    except OSError:
        return open(os.devnull, "wb")


def backlog(runs: Runs) -> list[Path]:
    """Journals that MLflow does not have whole."""
    return [path for path in sorted(runs.tracking.glob("*.jsonl")) if unsent(path)]


def process_tags() -> dict[str, str]:
    """This process, by which a run tells whose it is."""
    return {"iowbc.pid": str(os.getpid()), "iowbc.host": host(), "iowbc.boot": boot()}
