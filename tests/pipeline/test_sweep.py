"""A sweep runs every point once, makes what they share once, survives failures and kills, and sums up."""

import csv
import json
import shlex
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from fake_stages import STARTED
from workplace import SLOW, Workplace, until

from iowbc.commands.points import PointProcess, PointThread
from iowbc.commands.process import RunEnding
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.tracking.journal import events

GRID = ("--set", "seed=0,1", "--set", "teacher.steps=4096,8192")


def counts(workplace: Workplace) -> dict[str, int]:
    return {stage: len(workplace.store.artifacts(stage)) for stage in ("rg-dataset", "teacher", "export")}


def test_points_share_stages_and_are_summed_up(workplace: Workplace) -> None:
    done = workplace.command("sweep", "small.yaml", *GRID, "--jobs", "2")
    assert done.code == 0, done.errors
    assert "4 points: 20 stages would run, 4 are shared, 0 cached" in done.output
    assert counts(workplace) == {"rg-dataset": 2, "teacher": 4, "export": 4}
    folder = workplace.folder / "runs" / "sweeps" / "small-seed-steps"
    table = (folder / "table.md").read_text().splitlines()
    assert table[2] == "| steps | seeds | export count |"
    assert table[4] == "| 4096 | 2 | 3 ± 0 |"
    with (folder / "points.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["seed"], row["teacher.steps"], row["state"]) for row in rows][1] == ("0", "8192", "done")
    compared = workplace.command("compare", "small-seed-steps", "--json")
    assert {one["run"] for one in json.loads(compared.output)["metrics"]} == {row["point"] for row in rows}

    wider = workplace.command("sweep", "small.yaml", "--set", "seed=0..2", *GRID[2:], "--dry-run")
    rows = [line.split()[1:] for line in wider.output.splitlines() if line.startswith("small-")]
    assert [row.count("cached") for row in rows] == [6] * 4 + [0] * 2
    assert [row.count("shared") for row in rows] == [0] * 5 + [2]


def test_what_points_share_is_one_measurement_without_an_interval(workplace: Workplace) -> None:
    grid = ("--set", "distill.seed=0,1", "--set", "teacher.steps=4096,8192")
    done = workplace.command("sweep", "small.yaml", *grid, "--until", "teacher")
    assert done.code == 0, done.errors
    table = (workplace.folder / "runs" / "sweeps" / "small-seed-steps" / "table.md").read_text().splitlines()
    assert table[4] == "| 4096 | 2 | 3 |"


def test_two_settings_whose_paths_end_alike_are_told_apart(workplace: Workplace) -> None:
    grid = ("--set", "teacher.steps=4096,8192", "--set", "distill.steps=2048,4096")
    done = workplace.command("sweep", "small.yaml", *grid, "--until", "rg-dataset")
    assert done.code == 0, done.errors
    table = (workplace.folder / "runs" / "sweeps" / "small-steps-steps" / "table.md").read_text().splitlines()
    assert table[2] == "| teacher.steps | distill.steps | seeds | rg-dataset count |"


def test_a_point_that_fails_does_not_stop_the_others(workplace: Workplace) -> None:
    behaviour = {"teacher": {"fail": "it got lost", "seed": 1}}
    done = workplace.command("sweep", "small.yaml", "--set", "seed=0..2", behaviour=behaviour)
    assert done.code == 1
    assert "small-seed-2: done" in done.output
    assert "1 of 3 points failed:\n  small-seed-1: teacher failed: it got lost" in done.errors
    assert done.errors.strip().splitlines()[-1] == "iowbc sweep small.yaml --set seed=0..2"
    assert counts(workplace)["export"] == 2


def test_results_of_other_points_do_not_remain_in_the_folder_of_a_sweep(workplace: Workplace) -> None:
    table = workplace.folder / "runs" / "sweeps" / "small-seed" / "table.md"
    assert workplace.command("sweep", "small.yaml", "--set", "seed=0..1", "--until", "rg-dataset").code == 0
    failing = {"rg-dataset": {"fail": "it got lost"}}
    assert table.exists()
    assert workplace.command("sweep", "small.yaml", "--set", "seed=2..3", behaviour=failing).code == 1
    assert not table.exists()


def test_a_kill_and_ctrl_c_lose_nothing_and_the_last_line_goes_on(workplace: Workplace) -> None:
    words = ("sweep", "small.yaml", "--jobs", "2", "--set", "seed=0..1", "--until", "teacher")
    killed = workplace.start(*words, behaviour=SLOW)
    checkpoints = workplace.folder / "runs" / "work"
    until(lambda: len(list(checkpoints.glob("*/scratch/checkpoint.one"))) == 2 and workplace.checkpoint("teacher") > 0)
    killed.signal(signal.SIGKILL)
    killed.finish()
    until(lambda: not any(holder(workplace.store.runs, path.name) for path in checkpoints.iterdir()))

    asked = workplace.start(*words, behaviour=SLOW)
    until(lambda: logs(workplace).count("goes on from attempt 1") == 2)
    asked.signal(signal.SIGINT)
    assert asked.finish() == 130
    assert "(0 of 2 done, 2 stopped)" in asked.output
    last = shlex.split(asked.errors.strip().splitlines()[-1])
    assert last == ["iowbc", *words]

    again = workplace.command(*last[1:])
    assert again.code == 0, again.errors
    teachers = workplace.store.artifacts("teacher")
    assert [artifact.manifest.attempts for artifact in teachers] == [3, 3]
    assert all(json.loads((artifact.folder / STARTED).read_text()) > 0 for artifact in teachers)
    assert counts(workplace) == {"rg-dataset": 2, "teacher": 2, "export": 0}


def logs(workplace: Workplace) -> str:
    return "".join(path.read_text() for path in workplace.folder.glob("runs/sweeps/*/logs/*.log"))


def test_mlflow_is_told_of_a_run_above_those_of_the_points(workplace: Workplace) -> None:
    done = workplace.command(
        "sweep", "small.yaml", "--set", "seed=0,1", "--set", "execution.track=true", "--until", "teacher",
        "--set", "execution.tracking_patience=0", FAKE_SENDER="off",
    )  # fmt: skip
    assert done.code == 0, done.errors
    told = {path.stem: list(events(path)) for path in (workplace.folder / "runs" / "tracking").glob("*.jsonl")}
    runs = {stem: next(event for event in own if event["event"] == "run") for stem, own in told.items()}
    (above,) = [stem for stem, run in runs.items() if run["parent"] is None]
    assert runs[above]["params"]["seed"] == "0, 1"
    assert sorted(run["name"] for run in runs.values() if run["parent"] == f"{above}/recipe") == [
        "small-seed-0",
        "small-seed-1",
    ]
    assert "runs" not in told[above][-2]["paths"][0]
    assert told[above][-1]["status"] == "FINISHED"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_point_whose_log_cannot_be_written_fails(tmp_path: Path) -> None:
    task: Any = SimpleNamespace(name="point", log=tmp_path / "missing" / "log", carried_out=lambda log: RunEnding(0))
    point = PointThread(task, lambda: None)
    point.join()
    ending = point.ending()
    assert ending is not None
    assert ending.code != 0
    assert "cannot be written" in ending.failure


def test_an_ending_with_many_artifacts_does_not_fill_the_pipe(tmp_path: Path) -> None:
    large: Any = {"eval": b"x" * 2**20}
    task: Any = SimpleNamespace(name="point", log=tmp_path / "log", carried_out=lambda log: RunEnding(0, "", large))
    process = PointProcess(task)
    endings = []
    until(lambda: endings.append(process.ending()) or endings[-1])
    assert endings[-1] == RunEnding(0)
