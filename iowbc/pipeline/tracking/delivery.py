"""One journal on its way to MLflow: each event at least once, and to no other effect when it comes twice.

A line that is damaged is put aside in `runs/damaged/` and named; the others go on.
"""

import contextlib
import os
import shutil
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from iowbc.pipeline.store.locks import named_lock
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.journal import (
    close_orphaned,
    header,
    lines,
    lives,
    mark_sent,
    note_status,
    sent,
    sent_path,
    statuses,
    unsent,
)
from iowbc.recipe.execution import Execution

if TYPE_CHECKING:
    from mlflow.entities import Run
    from mlflow.tracking import MlflowClient

DAMAGED_LINE = "journal-"
"""Begins the name of a file with a line that was put aside."""
URI_VARIABLE = "MLFLOW_TRACKING_URI"
MAXIMUM_METRICS = 1000
"""Metrics that MLflow takes in one call."""
MAXIMUM_PARAMETERS = 100
"""Parameters that MLflow takes in one call."""
MAXIMUM_TEXT = 5000
"""Longest value of a parameter or tag that MLflow's stores take [characters]."""
ORIGIN_TAG = "iowbc.origin"
"""Tag with a run's journal and its name there, by which a sender finds what another one made before it died."""
SERVED = "mlflow-artifacts:/"
"""Where the files of the embedded database are for MLflow: wherever its server keeps them, so that `runs` may move."""
REFUSALS = ("INVALID_PARAMETER_VALUE", "BAD_REQUEST", "RESOURCE_DOES_NOT_EXIST", "RESOURCE_ALREADY_EXISTS")
"""Answers that another attempt would not change; what was refused is left out."""


class Delivery:
    """Sends one journal. Reads each line once, however long the run is."""

    def __init__(self, runs: Runs, path: Path) -> None:
        self.runs, self.path = runs, path
        self.offset, self.ids = sent(path)
        self.statuses = statuses(path, self.offset)
        self.refused: set[str] = set()
        """Runs that MLflow did not make; nothing is told of them."""
        self._checked = -1
        self._client: MlflowClient | None = None
        self._embedded = False
        """Whether it goes to the database in `runs`."""
        self._experiment = ""

    def lives(self) -> bool:
        """Whether the journal's process lives; the runs of one that does not are ended, once."""
        if lives(self.path):
            return True
        size = self.path.stat().st_size
        if size != self._checked:
            close_orphaned(self.path)
            self._checked = self.path.stat().st_size
        return False

    def advance(self) -> bool:
        """Send what is new, and remove the journal once its run has finished; False where MLflow was not reached."""
        try:
            if self.offset < self.path.stat().st_size:
                self._connect()
                self._send()
            if set(self.statuses.values()) == {"FINISHED"} and not unsent(self.path) and not lives(self.path):
                self.path.unlink()
                sent_path(self.path).unlink(missing_ok=True)
        except Exception as error:
            print(f"{time.strftime('%F %T')} {self.path.name}: {type(error).__name__}: {error}", flush=True)
            return False
        return True

    @property
    def client(self) -> "MlflowClient":
        """The store or server that the journal names."""
        assert self._client is not None
        return self._client

    def _connect(self) -> None:
        if self._client is None:
            first = header(self.path)
            own, uri = embedded_uri(self.runs), str(first.get("uri", tracking_uri()))
            made = client(uri or own)
            self._embedded = uri in ("", own)
            name = first.get("experiment") or Execution.model_fields["experiment"].default
            with set_up(self.runs):
                self._experiment = experiment(made, str(name), self.runs)
            self._client = made

    def _send(self) -> None:
        """Send event by event; neighbouring metrics of a run go in one call."""
        gathered: list[dict[str, Any]] = []
        position = self.offset
        for event, behind in lines(self.path, self.offset):
            if gathered and not _fits(gathered, event):
                self._metrics(gathered)
                self._mark(position)
                gathered = []
            if event is None:
                self._put_aside(position, behind)
                self._mark(behind)
                position = behind
                continue
            note_status(self.statuses, event)
            if event["event"] == "metrics":
                gathered.append(event)
            else:
                self._one(event)
                self._mark(behind)
            position = behind
        if gathered:
            self._metrics(gathered)
        self._mark(position)

    def _mark(self, offset: int) -> None:
        """All before this offset has been sent."""
        self.offset = offset
        mark_sent(self.path, offset, self.ids)

    def _put_aside(self, start: int, end: int) -> None:
        """Keep a damaged line where `status` and `gc --damaged` find it."""
        with self.path.open("rb") as file:
            file.seek(start)
            line = file.read(end - start)
        self.runs.damaged.mkdir(parents=True, exist_ok=True)
        aside = self.runs.damaged / f"{DAMAGED_LINE}{self.path.stem}-{start}.txt"
        aside.write_bytes(line)
        print(f"{self.path.name}: the line at byte {start} is damaged and put aside in {aside}", flush=True)

    def _one(self, event: Mapping[str, Any]) -> None:
        if event["event"] == "journal" or (event["event"] != "run" and not self._known(event)):
            return
        with _refusals_noted(self.path, event):
            if event["event"] == "run":
                self._run(event)
            elif event["event"] == "reopen":
                self.client.update_run(self.ids[event["id"]], status="RUNNING")
                self._batch(event["id"], tags=event["tags"])
            elif event["event"] == "tags":
                self._batch(event["id"], tags=event["tags"])
            elif event["event"] == "text":
                self._text(event)
            elif event["event"] == "files":
                self._files(event)
            elif event["event"] == "end":
                self.client.set_terminated(self.ids[event["id"]], event["status"], event["time"])

    def _known(self, event: Mapping[str, Any]) -> bool:
        """Whether MLflow has the run of an event. One whose beginning was damaged is made with what is known of it."""
        run = event["id"]
        if run not in self.ids and run not in self.refused:
            with _refusals_noted(self.path, event):
                parent = next(iter(self.ids), None)
                self._run({"id": run, "parent": parent, "name": run, "tags": {}, "params": {}, "time": event["time"]})
        return run in self.ids

    def _run(self, event: Mapping[str, Any]) -> None:
        tags = {**event["tags"], ORIGIN_TAG: f"{self.path.stem}/{event['id']}"}
        if event["parent"] in self.ids:
            tags["mlflow.parentRunId"] = self.ids[event["parent"]]
        elif "/" in (event["parent"] or ""):
            tags["mlflow.parentRunId"] = self._above(event)
        found = self._of(tags[ORIGIN_TAG])
        made = self._created(event, tags) if found is None else found
        self.ids[event["id"]] = made.info.run_id
        self._batch(event["id"], tags=None if found is None else tags, params=event["params"])

    def _of(self, origin: str) -> "Run | None":
        """The run that MLflow has of a place in a journal."""
        condition = f"tags.`{ORIGIN_TAG}` = '{origin}'"
        return next(iter(self.client.search_runs([self._experiment], condition, max_results=1)), None)

    def _above(self, event: Mapping[str, Any]) -> str:
        """Identifier of the run of another journal that this one belongs to: made here where that was not sent yet."""
        origin = event["parent"]
        known = {"id": origin, "name": origin.partition("/")[0], "time": event["time"]}
        above = self._of(origin) or self._created(known, {ORIGIN_TAG: origin})
        return str(above.info.run_id)

    def _created(self, event: Mapping[str, Any], tags: Mapping[str, str]) -> "Run":
        from mlflow.exceptions import MlflowException

        start, name = event["time"], event["name"]
        try:
            return self.client.create_run(self._experiment, start_time=start, tags=_cut(tags), run_name=name)
        except MlflowException as error:
            if error.error_code in REFUSALS:
                self.refused.add(event["id"])
            raise

    def _text(self, event: Mapping[str, Any]) -> None:
        run = self.ids[event["id"]]
        if self._embedded:
            (self._folder(run) / event["file"]).write_text(event["text"], encoding="utf-8")
        else:
            self.client.log_text(run, event["text"], event["file"])

    def _files(self, event: Mapping[str, Any]) -> None:
        run = self.ids[event["id"]]
        for path in (self.runs.root / name for name in event["paths"]):
            if self._embedded and path.is_dir():
                shutil.copytree(path, self._folder(run) / path.name, dirs_exist_ok=True)
            elif self._embedded and path.is_file():
                shutil.copyfile(path, self._folder(run) / path.name)
            elif path.is_dir():
                self.client.log_artifacts(run, str(path), path.name)
            elif path.is_file():
                self.client.log_artifact(run, str(path))

    def _folder(self, run: str) -> Path:
        """Where the files of a run of the embedded database lie: MLflow's server looks for them there."""
        folder = self.runs.tracked_files / run / "artifacts"
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def _metrics(self, gathered: list[dict[str, Any]]) -> None:
        from mlflow.entities import Metric

        if not self._known(gathered[0]):
            return
        with _refusals_noted(self.path, gathered[0]):
            metrics = [
                Metric(name, value, event["time"], event["step"])
                for event in gathered
                for name, value in event["values"].items()
            ]
            for start in range(0, len(metrics), MAXIMUM_METRICS):
                self.client.log_batch(self.ids[gathered[0]["id"]], metrics=metrics[start : start + MAXIMUM_METRICS])

    def _batch(
        self, run: str, *, tags: Mapping[str, str] | None = None, params: Mapping[str, str] | None = None
    ) -> None:
        from mlflow.entities import Param, RunTag

        texts = list(_cut(params or {}).items())
        for start in range(0, len(texts), MAXIMUM_PARAMETERS):
            chunk = [Param(name, text) for name, text in texts[start : start + MAXIMUM_PARAMETERS]]
            self.client.log_batch(self.ids[run], params=chunk)
        if tags:
            self.client.log_batch(self.ids[run], tags=[RunTag(name, text) for name, text in _cut(tags).items()])


def tracking_uri() -> str:
    """The tracking server that the environment names; empty stands for the database in `runs`, wherever that is."""
    return os.environ.get(URI_VARIABLE, "")


@contextlib.contextmanager
def set_up(runs: Runs) -> Iterator[None]:
    """Wait until no other process sets up the database or an experiment: MLflow's own set-up is not safe for two."""
    with named_lock(runs.tracking / "setup.lock"):
        yield


def client(uri: str) -> "MlflowClient":
    """A client of a tracking store or server."""
    from mlflow.tracking import MlflowClient

    return MlflowClient(tracking_uri=uri)


def experiment(client: "MlflowClient", name: str, runs: Runs) -> str:
    """Identifier of an experiment, which is made where it is missing; files of any database file lie under `runs/`."""
    found = client.get_experiment_by_name(name)
    if found is not None:
        return str(found.experiment_id)
    location = runs.tracked_files.absolute().as_uri() if client.tracking_uri.startswith("sqlite:") else None
    if client.tracking_uri == embedded_uri(runs):
        location = SERVED
    return str(client.create_experiment(name, artifact_location=location))


def embedded_uri(runs: Runs) -> str:
    """The database in `runs`, as MLflow names it."""
    return f"sqlite:///{runs.database.absolute()}"


def _fits(gathered: list[dict[str, Any]], event: Mapping[str, Any] | None) -> bool:
    """Whether an event can go in one call with these metrics."""
    if event is None or event["event"] != "metrics":
        return False
    count = sum(len(earlier["values"]) for earlier in gathered) + len(event["values"])
    return gathered[0]["id"] == event["id"] and count <= MAXIMUM_METRICS


def _cut(texts: Mapping[str, str]) -> dict[str, str]:
    return {name: text[:MAXIMUM_TEXT] for name, text in texts.items()}


@contextlib.contextmanager
def _refusals_noted(path: Path, event: Mapping[str, Any]) -> Iterator[None]:
    from mlflow.exceptions import MlflowException

    try:
        yield
    except MlflowException as error:
        if error.error_code not in REFUSALS:
            raise
        print(f"{path.name}: MLflow refused '{event['event']}' of {event.get('id')}: {error.message}", flush=True)
