"""Delivery of journals to MLflow: each event at least once; repeated delivery has no further effect.

A damaged line is set aside in `runs/damaged/` and logged; the others are sent. One sender process at a time serves a
`runs/` folder: `python -m iowbc.pipeline.tracking.delivery RUNS`. It runs while any journal's process is alive, ends
the runs of dead processes as KILLED, and leaves unsent data to the next sender.
"""

import itertools
import os
import shutil
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from iowbc.pipeline.store.locks import named_lock
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.journal import PARENT, close_orphaned, header, lines, mark_sent, sent, sent_path, statuses
from iowbc.recipe.execution import Execution

if TYPE_CHECKING:
    from mlflow.tracking import MlflowClient

DAMAGED_LINE = "journal-"
"""Prefix of the file of a damaged line."""
URI_VARIABLE = "MLFLOW_TRACKING_URI"
MAXIMUM_TEXT = 5000
"""Longest value of a parameter or tag that MLflow's stores take [characters]."""
ORIGIN_TAG = "iowbc.origin"
"""Tag with a run's journal and its name there, by which a sender finds what another one made before it died."""
POLL = 0.5
"""Polling interval of the journals of live processes [s]."""
RETRIES, RETRY_WAIT = 3, 2.0
"""Failed attempts in sequence before giving up, if no journal's process is alive, and wait between them [s]."""
SERVED = "mlflow-artifacts:/"
"""Artifact location in the embedded database, relative to MLflow's server, so that `runs` can be moved."""
REFUSALS = ("INVALID_PARAMETER_VALUE", "BAD_REQUEST", "RESOURCE_DOES_NOT_EXIST", "RESOURCE_ALREADY_EXISTS")
"""Error codes that a retry would not change; the refused event is skipped."""


class Delivery:
    """Sender of one journal, which reads each line once."""

    def __init__(self, runs: Runs, path: Path) -> None:
        self.runs, self.path = runs, path
        self.offset = sent(path)
        self._ids: dict[str, str] = {}
        """MLflow's identifiers of the journal's runs that this sender has looked up."""
        self._checked = -1
        """Size of the journal when its process was found dead and its runs were ended."""
        self._finished = False
        self._client: Any = None
        """MLflow's client of the store or server that the journal names."""
        self._embedded = False
        """True where it goes to the database in `runs`."""
        self._experiment = ""

    def lives(self) -> bool:
        """True while the journal's process lives; the runs of one that does not are ended, once."""
        if self._checked == self.path.stat().st_size:
            return False
        if not close_orphaned(self.path):
            return True
        self._checked = self.path.stat().st_size
        self._finished = set(statuses(self.path).values()) == {"FINISHED"}
        return False

    def advance(self) -> bool:
        """Send new events, and remove the journal once its run has finished; False after an error."""
        try:
            if self.offset < self.path.stat().st_size:
                self._connect()
                self._send()
            if not self.lives() and self._finished and self.offset == self._checked:
                self.path.unlink()
                sent_path(self.path).unlink(missing_ok=True)
        except Exception as error:
            print(f"{time.strftime('%F %T')} {self.path.name}: {type(error).__name__}: {error}", flush=True)
            return False
        return True

    def _connect(self) -> None:
        if self._client is None:
            first = header(self.path)
            own = embedded_uri(self.runs)
            uri = str(first.get("uri", tracking_uri())) or own
            self._embedded = uri == own
            name = first.get("experiment") or Execution.model_fields["experiment"].default
            self._client, self._experiment = open_experiment(self.runs, uri, str(name))

    def _send(self) -> None:
        """Send event by event; neighbouring metrics of a run go together."""

        def together(line: tuple[dict[str, Any] | None, int]) -> object:
            event, end = line
            return event["id"] if event is not None and event["event"] == "metrics" else end

        for _, group in itertools.groupby(lines(self.path, self.offset), together):
            found, ends = zip(*group, strict=True)
            if found[0] is None:
                self._put_aside(ends[-1])
            elif found[0]["event"] != "journal":
                self._deliver(found)
            self.offset = ends[-1]
            mark_sent(self.path, self.offset)

    def _put_aside(self, end: int) -> None:
        """Keep a damaged line where `status` and `gc --damaged` find it."""
        self.runs.damaged.mkdir(parents=True, exist_ok=True)
        aside = self.runs.damaged / f"{DAMAGED_LINE}{self.path.stem}-{self.offset}.txt"
        aside.write_bytes(self.path.read_bytes()[self.offset : end])
        print(f"{self.path.name}: the line at byte {self.offset} is damaged and put aside in {aside}", flush=True)

    def _deliver(self, found: Sequence[dict[str, Any]]) -> None:
        """Send one event, or several with metrics of one run; MLflow's refusal is noted, and they are left out."""
        from mlflow.entities import Metric
        from mlflow.exceptions import MlflowException

        event, kind = found[0], found[0]["event"]
        try:
            run = self._run_of(event)
            if kind == "metrics":
                metrics = [
                    Metric(name, value, one["time"], one["step"])
                    for one in found
                    for name, value in one["values"].items()
                ]
                self._client.log_batch(run, metrics=metrics)
            elif kind in ("reopen", "tags"):
                if kind == "reopen":
                    self._client.update_run(run, status="RUNNING")
                self._describe(run, event["tags"], {})
            elif kind == "files":
                self._files(run, event["paths"])
            elif kind == "end":
                self._client.set_terminated(run, event["status"], event["time"])
        except MlflowException as error:
            if error.error_code not in REFUSALS:
                raise
            print(f"{self.path.name}: MLflow refused '{kind}' of {event['id']}: {error.message}", flush=True)

    def _run_of(self, event: Mapping[str, Any]) -> str:
        """MLflow's identifier of an event's run; the run is created if MLflow has none yet."""
        name = event["id"]
        if name not in self._ids:
            unknown = {"parent": None if name == PARENT else PARENT, "name": name, "tags": {}, "params": {}}
            begun = event if event["event"] == "run" else {**unknown, "time": event["time"]}
            run = self._found_or_made(name, begun["name"], begun["time"])
            parent, tags = begun["parent"], dict(begun["tags"])
            if parent is not None:
                above = self._ids.get(parent) or self._found_or_made(parent, parent.partition("/")[0], begun["time"])
                tags["mlflow.parentRunId"] = above
            self._describe(run, tags, begun["params"])
            self._ids[name] = run
        return self._ids[name]

    def _found_or_made(self, identifier: str, name: str, moment: int) -> str:
        """MLflow's run for an identifier in this journal, or for `JOURNAL/IDENTIFIER`; created if there is none."""
        origin = identifier if "/" in identifier else f"{self.path.stem}/{identifier}"
        condition = f"tags.`{ORIGIN_TAG}` = '{origin}'"
        found = self._client.search_runs([self._experiment], condition, max_results=1)
        if found:
            return str(found[0].info.run_id)
        tags = {ORIGIN_TAG: origin}
        made = self._client.create_run(self._experiment, start_time=moment, tags=tags, run_name=name)
        return str(made.info.run_id)

    def _describe(self, run: str, tags: Mapping[str, str], params: Mapping[str, str]) -> None:
        from mlflow.entities import Param, RunTag

        self._client.log_batch(run, tags=[RunTag(name, text[:MAXIMUM_TEXT]) for name, text in tags.items()])
        if params:  # a refused one loses no tags
            self._client.log_batch(run, params=[Param(name, text[:MAXIMUM_TEXT]) for name, text in params.items()])

    def _files(self, run: str, names: Sequence[str]) -> None:
        """Send files and folders below `runs`; for the embedded database copy them to MLflow's artifact folder."""
        folder = self.runs.tracked_files / run / "artifacts"
        for path in (self.runs.root / name for name in names):
            if path.exists() and not self._embedded:
                self._client.log_artifact(run, str(path))
            elif path.is_dir():
                shutil.copytree(path, folder / path.name, dirs_exist_ok=True)
            elif path.is_file():
                folder.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, folder / path.name)


def tracking_uri() -> str:
    """The tracking server that the environment names; empty stands for the database in `runs`, wherever that is."""
    return os.environ.get(URI_VARIABLE, "")


def open_experiment(runs: Runs, uri: str, name: str) -> "tuple[MlflowClient, str]":
    """A client of a tracking store or server, and the identifier of an experiment there, created if missing and
    restored if deleted; files of an SQLite store lie under `runs/`. One process at a time: MLflow does not protect the
    set-up of a database."""
    from mlflow.tracking import MlflowClient

    with named_lock(runs.tracking / "setup.lock"):
        client = MlflowClient(tracking_uri=uri)
        if (found := client.get_experiment_by_name(name)) is not None:
            if found.lifecycle_stage == "deleted":  # it takes no runs, and its name remains taken
                client.restore_experiment(found.experiment_id)
            return client, str(found.experiment_id)
        location = runs.tracked_files.absolute().as_uri() if uri.startswith("sqlite:") else None
        if uri == embedded_uri(runs):
            location = SERVED
        return client, str(client.create_experiment(name, artifact_location=location))


def embedded_uri(runs: Runs) -> str:
    """The database in `runs`, as MLflow names it."""
    return f"sqlite:///{runs.database.absolute()}"


def main(root: Path) -> int:
    """Send until nothing is left and no process writes any more; 0 where MLflow has everything."""
    os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_TIMEOUT", "10")
    os.environ.setdefault("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "1")
    runs, deliveries = Runs(root), dict[Path, Delivery]()
    with named_lock(runs.tracking / "sender.lock"):
        failures = 0
        while True:
            paths = sorted(runs.tracking.glob("*.jsonl"))
            deliveries = {path: deliveries.get(path) or Delivery(runs, path) for path in paths}
            living, failed = False, False
            for delivery in deliveries.values():
                living |= delivery.lives()
                failed |= not delivery.advance()
            failures = failures + 1 if failed else 0
            if not living and (failures == 0 or failures >= RETRIES):
                return 1 if failed else 0
            time.sleep(RETRY_WAIT if failed else POLL)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
