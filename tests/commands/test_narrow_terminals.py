"""Plans and differences read well on 80 characters, and numbers as people write them."""

import io
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest
from rich.console import Console

from iowbc.commands.diff import diff
from iowbc.commands.ls import list_artifacts
from iowbc.commands.sweep_plan import PlannedStage, plan_table
from iowbc.commands.tables import hanging
from iowbc.pipeline.console.wording import figure
from iowbc.pipeline.planner import Step
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

Command = Callable[..., "subprocess.CompletedProcess[str]"]
WIDTH = 80


def test_a_difference_is_drawn_on_a_terminal_stage_by_stage(folder: Path, command: Command) -> None:
    (folder / "third.yaml").write_text("extends: first.yaml\nseed: 4\n")
    assert command("run", "third.yaml", "--until", "rg-fit").returncode == 0
    written = io.StringIO()
    console = Console(file=written, force_terminal=True, color_system=None, width=WIDTH)
    diff(Store(Runs(folder / "runs")), console, "first", "third")
    lines = written.getvalue().splitlines()
    assert all(len(line) <= WIDTH for line in lines)
    assert ["seed", "3", "4"] in [line.split() for line in lines]
    assert lines.index("recipe") < lines.index("rg-dataset") < lines.index("rg-fit")
    (reads,) = [line.split() for line in lines if "input rg-dataset" in line]
    assert [len(digest) for digest in reads[2:]] == [12, 12], "a digest is shown by its first characters"


@pytest.mark.parametrize("width", [WIDTH, 120])
def test_a_list_of_artifacts_keeps_every_column_whole(folder: Path, width: int) -> None:
    written = io.StringIO()
    store = Store(Runs(folder / "runs"))
    for artifact in store.artifacts("teacher"):
        metrics = {f"a_metric_with_a_name_of_its_own_{number}": 1.5 for number in range(3)}
        (artifact.folder / "summary.json").write_text(json.dumps({"metrics": metrics}))
    list_artifacts(store, Console(file=written, width=width), None)
    lines = written.getvalue().splitlines()
    assert all(len(line) <= width for line in lines)
    assert lines[0].split()[:6] == ["stage", "key", "used", "by", "made", "took"]
    for artifact in store.artifacts("teacher"):
        (row,) = [line for line in lines if artifact.manifest.key[:12] in line]
        assert row.startswith("teacher ")
        assert row.split()[2] in ("first", "second")


@pytest.mark.parametrize("what", ["recipe", "point"])
@pytest.mark.parametrize("name", ["full_seed_1", "quickstart-seed-0-use_rg-true-d06fd9"])
def test_a_plan_of_several_recipes_keeps_names_and_times_whole(what: str, name: str) -> None:
    stages = ("rg-dataset", "rg-fit", "teacher", "distill", "eval", "export")
    times = (0.5, 42.0, 7500.0, 7500.0, 600.0, None)
    steps = [
        Step(cast(Stage, SimpleNamespace(name=stage)), None, None, None, reasons=("new",), roughly=seconds)
        for stage, seconds in zip(stages, times, strict=True)
    ]
    written = io.StringIO()
    table = plan_table({name: [PlannedStage(step, "") for step in steps]}, what)
    Console(file=written, width=WIDTH).print(table)
    head, *rows = written.getvalue().splitlines()
    assert all(len(line) <= WIDTH for line in (head, *rows))
    assert head.split() == [what, *stages]
    folded = "".join(row[: head.index(stages[0])].strip() for row in rows)
    assert folded == name
    assert rows[0][head.index(stages[0]) :].split("  ")[0].strip() == "~0.5 s"
    assert all(time in rows[0] for time in ("~42 s", "~2 h 05 min", "~10 min", "run"))


def test_what_does_not_fit_stands_further_to_the_right() -> None:
    line = "eval.lifting.masses (recipes/full.yaml:13:14): [0.0, 2.0, 4.0] -> [0.0, 1.0]"
    assert hanging(line, 60, 4).splitlines() == [
        "    eval.lifting.masses (recipes/full.yaml:13:14): [0.0,",
        "      2.0, 4.0] -> [0.0, 1.0]",
    ]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2402304.0, "2,402,304"),
        (0.0, "0"),
        (1107.47, "1,107"),
        (0.123456, "0.1235"),
        (1e15, "1e+15"),
        (float("nan"), "nan"),
        (-2.5, "-2.5"),
    ],
)
def test_a_whole_number_is_written_out(value: float, text: str) -> None:
    assert figure(value) == text


def test_a_change_has_its_sign() -> None:
    assert (figure(6.0, 3, "+"), figure(-2398208.0, 3, "+"), figure(0.01764, 3, "+")) == ("+6", "-2,398,208", "+0.0176")
