"""The process that sends journals to MLflow: `python -m iowbc.pipeline.sender RUNS`.

One at a time works on a `runs/` folder, so that a fresh database is set up by one process alone. It stays as long as a
journal's process lives, ends the runs of processes that died as KILLED, and leaves what a server does not take for the
next one.
"""

import contextlib
import fcntl
import os
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from iowbc.pipeline.journal import close_orphaned, events, header, mark_sent, sent, sent_path, statuses, unsent
from iowbc.pipeline.layout import Runs

if TYPE_CHECKING:
    from mlflow.tracking import MlflowClient

POLL = 0.5
"""Seconds between two looks at the journals of living processes."""
RETRIES = 3
"""Attempts at a server that does not answer, after the last living process has gone."""
RETRY_WAIT = 2.0
"""Seconds before another attempt at a server that did not answer."""
MAXIMUM_METRICS = 1000
"""Metrics that MLflow takes in one call."""
MAXIMUM_PARAMETERS = 100
"""Parameters that MLflow takes in one call."""
MAXIMUM_TEXT = 5000
"""Longest value of a parameter or tag that MLflow's stores take [characters]."""
REFUSALS = ("INVALID_PARAMETER_VALUE", "BAD_REQUEST", "RESOURCE_DOES_NOT_EXIST", "RESOURCE_ALREADY_EXISTS")
"""Answers that another attempt would not change; what was refused is left out."""


def main(root: Path) -> int:
    """Send until nothing is left and no process writes any more; 0 where MLflow has everything."""
    os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_TIMEOUT", "10")
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "1")
    runs = Runs(root)
    with sole_sender(runs):
        failures = 0
        while True:
            living = False
            failed = False
            for path in sorted(runs.tracking.glob("*.jsonl")):
                living |= not close_orphaned(path)
                failed |= not delivered(runs, path)
            failures = failures + 1 if failed else 0
            if not living and (failures == 0 or failures >= RETRIES):
                return 1 if failed else 0
            time.sleep(RETRY_WAIT if failed else POLL)


@contextlib.contextmanager
def sole_sender(runs: Runs) -> Iterator[None]:
    """Wait until no other process sends the journals of this folder."""
    with _locked(runs, "sender.lock"):
        yield


@contextlib.contextmanager
def set_up(runs: Runs) -> Iterator[None]:
    """Wait until no other process sets up the database or an experiment: MLflow's own set-up is not safe for two."""
    with _locked(runs, "setup.lock"):
        yield


@contextlib.contextmanager
def _locked(runs: Runs, name: str) -> Iterator[None]:
    runs.tracking.mkdir(parents=True, exist_ok=True)
    with (runs.tracking / name).open("a") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def delivered(runs: Runs, path: Path) -> bool:
    """Send what is new in a journal, and remove it once its run has finished; False where MLflow was not reached."""
    try:
        if unsent(path):
            _Delivery(runs, path).send()
        if not unsent(path) and set(statuses(path).values()) == {"FINISHED"}:
            path.unlink()
            sent_path(path).unlink(missing_ok=True)
    except Exception as error:
        print(f"{time.strftime('%F %T')} {path.name}: {type(error).__name__}: {error}", flush=True)
        return False
    return True


class _Delivery:
    """One journal on its way to MLflow."""

    def __init__(self, runs: Runs, path: Path) -> None:
        self.path = path
        self.offset, self.ids = sent(path)
        first = header(path)
        self.client = client(str(first["uri"]))
        with set_up(runs):
            self.experiment = experiment(self.client, str(first["experiment"]), runs)

    def send(self) -> None:
        """Send event by event; neighbouring metrics of a run go in one call."""
        gathered: list[dict[str, Any]] = []
        for event, offset in events(self.path, self.offset):
            mergeable = event["event"] == "metrics"
            if gathered and not (mergeable and _fits(gathered, event)):
                self._metrics(gathered)
                gathered = []
            if mergeable:
                gathered.append(event)
            else:
                self._one(event)
                self._mark(offset)
            self.offset = offset
        if gathered:
            self._metrics(gathered)
        self._mark(self.offset)

    def _mark(self, offset: int) -> None:
        mark_sent(self.path, offset, self.ids)

    def _one(self, event: Mapping[str, Any]) -> None:
        with _refusals_noted(self.path, event):
            if event["event"] == "run":
                self._run(event)
            elif event["event"] == "reopen":
                self.client.update_run(self.ids[event["id"]], status="RUNNING")
                self._batch(event["id"], tags=event["tags"])
            elif event["event"] == "tags":
                self._batch(event["id"], tags=event["tags"])
            elif event["event"] == "text":
                self.client.log_text(self.ids[event["id"]], event["text"], event["file"])
            elif event["event"] == "files":
                self._files(event)
            elif event["event"] == "end":
                self.client.set_terminated(self.ids[event["id"]], event["status"], event["time"])

    def _run(self, event: Mapping[str, Any]) -> None:
        tags = dict(event["tags"])
        if event["parent"]:
            tags["mlflow.parentRunId"] = self.ids[event["parent"]]
        run = self.client.create_run(
            self.experiment, start_time=event["time"], tags=_cut(tags), run_name=event["name"]
        ).info.run_id
        self.ids[event["id"]] = run
        self._batch(event["id"], params=event["params"])

    def _files(self, event: Mapping[str, Any]) -> None:
        for path in map(Path, event["paths"]):
            if path.is_dir():
                self.client.log_artifacts(self.ids[event["id"]], str(path), path.name)
            elif path.is_file():
                self.client.log_artifact(self.ids[event["id"]], str(path))

    def _metrics(self, gathered: list[dict[str, Any]]) -> None:
        from mlflow.entities import Metric

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


def client(uri: str) -> "MlflowClient":
    """A client of a tracking store or server."""
    from mlflow.tracking import MlflowClient

    return MlflowClient(tracking_uri=uri)


def experiment(client: "MlflowClient", name: str, runs: Runs) -> str:
    """Identifier of an experiment, which is made where it is missing; files of the embedded store lie under `runs/`."""
    found = client.get_experiment_by_name(name)
    if found is not None:
        return str(found.experiment_id)
    embedded = client.tracking_uri.startswith("sqlite:")
    location = runs.tracked_files.absolute().as_uri() if embedded else None
    return str(client.create_experiment(name, artifact_location=location))


def _fits(gathered: list[dict[str, Any]], event: Mapping[str, Any]) -> bool:
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


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
