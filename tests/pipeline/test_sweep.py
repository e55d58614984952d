"""A sweep runs every point once, makes what they share once, survives failures and kills, and sums up."""

import csv
import json
import shlex
import signal

from fake_stages import STARTED
from workplace import Workplace, until

from iowbc.pipeline.tracking.journal import events

GRID = ("--set", "seed=0,1", "--set", "teacher.steps=4096,8192")
SLOW = {"teacher": {"steps": 30, "pause": 0.1}}


def counts(workplace: Workplace) -> dict[str, int]:
    return {stage: len(workplace.store.artifacts(stage)) for stage in ("rg-dataset", "teacher", "export")}


def test_points_share_stages_and_are_summed_up(workplace: Workplace) -> None:
    planned = workplace.command("sweep", "small.yaml", *GRID, "--dry-run")
    assert "4 points: 20 stages would run, 4 are shared, 0 cached" in planned.output
    done = workplace.command("sweep", "small.yaml", *GRID, "--jobs", "2")
    assert done.code == 0, done.errors
    assert counts(workplace) == {"rg-dataset": 2, "teacher": 4, "export": 4}
    folder = workplace.folder / "runs" / "sweeps" / "small-seed-steps"
    table = (folder / "table.md").read_text().splitlines()
    assert table[2] == "| steps | seeds | export count |"
    assert table[4] == "| 4096 | 2 | 3 ± 0 |"
    assert (folder / "parallel.png").stat().st_size > 10_000
    with (folder / "points.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["seed"], row["teacher.steps"], row["state"]) for row in rows][1] == ("0", "8192", "done")
    compared = workplace.command("compare", "small-seed-steps", "--json")
    assert {one["run"] for one in json.loads(compared.output)["metrics"]} == {row["point"] for row in rows}

    wider = workplace.command("plan", "small.yaml", "--sweep", "--set", "seed=0..2", *GRID[2:], "--json")
    points = json.loads(wider.output)["points"]
    assert [all(stage["cached"] for stage in point["stages"]) for point in points] == [True] * 4 + [False] * 2
    assert points[5]["stages"][0]["shared_with"] == points[4]["point"]


def test_a_point_that_fails_does_not_stop_the_others(workplace: Workplace) -> None:
    behaviour = {"teacher": {"fail": "it got lost", "seed": 1}}
    done = workplace.command("sweep", "small.yaml", "--set", "seed=0..2", behaviour=behaviour)
    assert done.code == 1
    assert "small-seed-2: done" in done.output
    assert "1 of 3 points failed:\n  small-seed-1: teacher failed: it got lost" in done.errors
    assert done.errors.strip().splitlines()[-1] == "iowbc sweep small.yaml --jobs 1 --set seed=0..2"
    assert counts(workplace)["export"] == 2
    assert workplace.command("sweep", "small.yaml", "--set", "seed=0..2", "-q").code == 0
    assert counts(workplace)["export"] == 3


def test_ctrl_c_stops_all_points_at_a_checkpoint_and_the_last_line_goes_on(workplace: Workplace) -> None:
    command = workplace.start("sweep", "small.yaml", "--set", "seed=0..2", "--jobs", "2", behaviour=SLOW)
    work = workplace.folder / "runs" / "work"
    until(lambda: len(list(work.glob("*/scratch/checkpoint.one"))) == 2 and workplace.checkpoint("teacher") > 0)
    command.signal(signal.SIGINT)
    assert command.finish() == 130
    assert "(0 of 3 done, 2 stopped)" in command.output
    last = shlex.split(command.errors.strip().splitlines()[-1])
    assert last == ["iowbc", "sweep", "small.yaml", "--jobs", "2", "--set", "seed=0..2"]

    again = workplace.command(*last[1:])
    assert again.code == 0, again.errors
    teachers = workplace.store.artifacts("teacher")
    assert sorted(artifact.manifest.attempts for artifact in teachers) == [1, 2, 2]
    assert sum(json.loads((artifact.folder / STARTED).read_text()) > 0 for artifact in teachers) == 2


def test_a_killed_sweep_takes_its_points_along_and_goes_on(workplace: Workplace) -> None:
    command = workplace.start("sweep", "small.yaml", "--set", "seed=0,1", behaviour=SLOW)
    until(lambda: workplace.checkpoint("teacher") > 0)
    command.signal(signal.SIGKILL)
    command.finish()
    reached = workplace.checkpoint("teacher")
    again = workplace.command("sweep", "small.yaml", "--set", "seed=0,1")
    assert again.code == 0, again.errors
    assert counts(workplace) == {"rg-dataset": 2, "teacher": 2, "export": 2}
    assert reached <= max(json.loads((a.folder / STARTED).read_text()) for a in workplace.store.artifacts("teacher"))


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
