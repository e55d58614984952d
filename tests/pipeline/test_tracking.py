"""MLflow hears everything, whatever happens to the run, and nothing waits for it."""

import json
import shutil
import signal
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from workplace import RECIPE, SLOW, Workplace, until

from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.tracking.delivery import embedded_uri, open_experiment
from iowbc.pipeline.tracking.journal import Journal, close_orphaned, statuses, unsent
from iowbc.pipeline.tracking.tracker import backlog

TRACKED = RECIPE.replace("track: false", "tracking_patience: 30")


def deliver(runs: Runs) -> int:
    """Send what is left, as the next run would."""
    command = [sys.executable, "-m", "iowbc.pipeline.tracking.delivery", str(runs.root)]
    return subprocess.run(command, check=False, timeout=120, stdin=subprocess.DEVNULL).returncode


def tracked(runs: Runs, query: str, *values: Any) -> list[tuple[Any, ...]]:
    """A question to MLflow's embedded database, without importing MLflow."""
    with sqlite3.connect(runs.database) as database:
        found = database.execute(query, values).fetchall()
    database.close()
    return found


def run_statuses(runs: Runs) -> list[tuple[str, dict[str, str]]]:
    """The status of each recipe run, oldest first, and those of its stages."""
    found = tracked(
        runs,
        "SELECT runs.run_uuid, runs.name, runs.status, tags.value FROM runs "
        "LEFT JOIN tags ON tags.run_uuid = runs.run_uuid AND tags.key = 'mlflow.parentRunId' ORDER BY start_time",
    )
    parents = {run: (status, dict[str, str]()) for run, _, status, parent in found if parent is None}
    for _, name, status, parent in found:
        if parent is not None:
            parents[parent][1][name] = status
    return list(parents.values())


def test_what_happens_to_runs_is_what_mlflow_shows(workplace: Workplace) -> None:
    """A failure, a signal, a kill, a resume, and a cached run; sent by one process at the end."""
    workplace.recipe.write_text(TRACKED)
    runs = workplace.store.runs
    quiet = {"FAKE_SENDER": "off"}
    failed = workplace.command("run", "small.yaml", behaviour={"rg-fit": {"raise": "out of luck"}}, **quiet)
    assert failed.code == 1
    stopped = workplace.start("run", "small.yaml", "--set", "eval.trials=7", behaviour=SLOW, **quiet)
    until(lambda: workplace.checkpoint("teacher") > 2)
    stopped.signal(signal.SIGTERM)
    assert stopped.finish() == 130
    killed = workplace.start("run", "small.yaml", "--set", "eval.trials=8", behaviour=SLOW, **quiet)
    until(lambda: workplace.checkpoint("teacher") > 5)
    killed.signal(signal.SIGKILL)
    killed.finish()
    assert workplace.command("run", "small.yaml", "--set", "eval.trials=7", **quiet).code == 0
    assert workplace.command("run", "small.yaml", "--set", "eval.trials=7", **quiet).code == 0
    assert deliver(runs) == 0

    whole = dict.fromkeys(("rg-dataset", "rg-fit", "teacher", "distill", "eval", "export"), "FINISHED")
    assert run_statuses(runs) == [
        ("FAILED", {"rg-dataset": "FINISHED", "rg-fit": "FAILED"}),
        ("FINISHED", whole),
        ("KILLED", {"rg-dataset": "FINISHED", "rg-fit": "FINISHED", "teacher": "KILLED"}),
    ], "the last run, all cached, adds nothing"
    assert backlog(runs) == []

    cached_tags = tracked(runs, "SELECT value FROM tags WHERE key = 'iowbc.cached'")
    assert cached_tags.count(("true",)) == 1 + 2  # of the second and the third run
    assert ("4096",) in tracked(runs, "SELECT value FROM params WHERE key = 'teacher.steps'")
    teacher = "(SELECT run_uuid FROM runs WHERE name = 'teacher' ORDER BY start_time LIMIT 1)"
    counted = tracked(runs, f"SELECT value FROM metrics WHERE key = 'count' AND run_uuid = {teacher} ORDER BY step")
    assert [value for (value,) in counted] == [float(step) for step in range(1, len(counted) + 1)]
    ((location,),) = tracked(runs, f"SELECT artifact_uri FROM runs WHERE run_uuid = {teacher}")
    assert files_of(runs, location) == {"figures", "tables", "key.json", "recipe.yaml"}


def files_of(runs: Runs, location: str) -> set[str]:
    """What the server of a `runs` folder finds for a run whose files MLflow has there."""
    assert location.startswith("mlflow-artifacts:/")
    return {path.name for path in (runs.tracked_files / location.removeprefix("mlflow-artifacts:/")).iterdir()}


def test_a_moved_folder_takes_mlflows_files_along_and_leaves_nothing_behind(workplace: Workplace) -> None:
    workplace.recipe.write_text(TRACKED)
    assert workplace.command("run", "small.yaml", "--until", "rg-dataset", FAKE_SENDER="off").code == 0
    former, here = workplace.store.runs, Runs(workplace.folder / "elsewhere" / "runs")
    shutil.copytree(former.root, here.root, symlinks=True)
    assert deliver(here) == 0
    assert not former.database.exists(), "what was not sent yet goes where the journal lies now"
    for (location,) in tracked(here, "SELECT artifact_uri FROM runs"):
        assert "recipe.yaml" in files_of(here, location)


def test_two_first_runs_at_once_share_a_fresh_database(workplace: Workplace) -> None:
    workplace.recipe.write_text(TRACKED)
    commands = [workplace.start("run", "small.yaml", "--set", f"seed={seed}") for seed in (1, 2)]
    assert [command.finish() for command in commands] == [0, 0]
    until(lambda: not backlog(workplace.store.runs))
    found = run_statuses(workplace.store.runs)
    assert [(status, set(stages.values()), len(stages)) for status, stages in found] == [
        ("FINISHED", {"FINISHED"}, 6)
    ] * 2


@pytest.mark.filterwarnings("ignore")  # of MLflow's own code
def test_an_experiment_that_was_deleted_takes_runs_again(tmp_path: Path) -> None:
    runs = Runs(tmp_path)
    client, experiment = open_experiment(runs, embedded_uri(runs), "tried")
    client.delete_experiment(experiment)
    client, again = open_experiment(runs, embedded_uri(runs), "tried")
    assert client.create_run(again).info.experiment_id == experiment


def test_a_server_that_is_away_stops_nothing_and_hears_everything_later(workplace: Workplace) -> None:
    workplace.recipe.write_text(TRACKED.replace("tracking_patience: 30", "tracking_patience: 0"))
    runs = workplace.store.runs
    away = workplace.folder / "away"
    away.write_text("not a folder: nothing can be stored here")
    uri = f"sqlite:///{away}/mlflow.db"
    command = workplace.command("run", "small.yaml", MLFLOW_TRACKING_URI=uri, FAKE_SENDER="off")
    assert command.code == 0
    assert deliver(runs) == 1
    assert len(backlog(runs)) == 1
    assert "1 runs" in workplace.command("status").output
    away.unlink()
    assert deliver(runs) == 0
    assert backlog(runs) == []
    with sqlite3.connect(away / "mlflow.db") as database:
        assert database.execute("SELECT COUNT(*) FROM runs WHERE status = 'FINISHED'").fetchone() == (7,)
    database.close()


def test_the_journal_of_a_dead_process_is_closed_as_killed(tmp_path: Path) -> None:
    path = tmp_path / "journal.jsonl"
    with closing(Journal(path)) as journal:
        assert journal.acquire()
        journal.write("run", id="recipe", parent=None)
        journal.write("run", id="teacher", parent="recipe")
        journal.write("run", id="rg-fit", parent="recipe")
        journal.write("end", id="rg-fit", status="FINISHED")
        assert not close_orphaned(path)
    with path.open("a") as file:
        file.write('{"event": "metrics", "id": "teac')
    assert close_orphaned(path)
    assert statuses(path) == {"recipe": "KILLED", "teacher": "KILLED", "rg-fit": "FINISHED"}
    assert [json.loads(line)["event"] for line in path.read_text().splitlines()].count("end") == 3
    assert unsent(path)
