"""What commands tell reads well on 80 characters, and numbers as people write them."""

import io
import json
import re
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest
from rich.console import Console
from sealing import sealed_anew

from iowbc.commands.compare import compare
from iowbc.commands.diff import diff
from iowbc.commands.listing import ls, show, status
from iowbc.commands.lookup import named
from iowbc.commands.plan import plan_table
from iowbc.commands.printed import hanging
from iowbc.pipeline.console.wording import figure
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.stage_plan import StagePlan
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.results.table import Column, Table, drawn, heads

Command = Callable[..., "subprocess.CompletedProcess[str]"]
WIDTH = 80
LONG = "lifting_with_partner_0.5/16kg/E_alpha"
"""The name of a metric as long as an evaluation's are."""


@pytest.fixture
def shown(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[str]]:
    """Lines that a command writes, of which none is too long."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))

    def lines(command: Callable[..., None], *arguments: object) -> list[str]:
        command(*arguments)
        written = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
        assert [line for line in written if len(line) > WIDTH] == []
        return written

    return lines


@pytest.fixture
def measured(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Store:
    """The folder's store; the teachers of both recipes measured something that has a long name."""
    monkeypatch.chdir(folder)
    store = Store(Runs(Path("runs")))
    for recipe, value in (("first", 0.0123456), ("second", 0.6543219)):
        metrics = {"count": 3.0, LONG: value, f"other_{LONG}": -1e-7 * value}
        Path("runs", recipe, "teacher", "summary.json").write_text(json.dumps({"metrics": metrics}))
        sealed_anew(Path("runs", recipe, "teacher"))
    return store


def test_a_comparison_keeps_every_number_and_the_difference(measured: Store, shown: Callable[..., list[str]]) -> None:
    lines = shown(compare, ["first", "second"])
    assert lines[0].split() == ["stage", "metric", "first", "second", "Δ", "second"]
    (row,) = [line.split() for line in lines if "0.01235" in line]
    assert row[0] == "teacher"
    assert row[-3:] == ["0.01235", "0.6543", "+0.642"]
    assert any(line.split()[-3:] == ["-1.235e-09", "-6.543e-08", "-6.42e-08"] for line in lines)
    start = lines[0].index("metric")
    assert "".join(line[start:].split()[0] for line in lines[1:5]) == f"{LONG}other_{LONG}"


@pytest.mark.parametrize(
    ("width", "head", "folds"),
    [
        (98, "stage metric a b Δb c Δc", False),
        (81, "stage metric a b Δb c Δc", True),
        (80, "stage metric a b Δb Δc", True),
        (70, "stage metric a Δb Δc", True),
        (60, "stage metric a Δb", True),
        (50, "stage metric a", True),
    ],
)
def test_a_narrow_comparison_folds_names_then_leaves_out_what_a_difference_tells(
    width: int, head: str, folds: bool
) -> None:
    numbers = ("0.012345", "0.654322", "+0.64197", "0.111111", "+0.09876")
    compared = [Column(name, role="detail") for name in "bc"]
    columns = heads("stage", "metric", "a", compared[0], "Δ b", compared[1], "Δ c")
    cells = Table("metrics", "", columns, [("teacher", LONG, *numbers)])
    written = io.StringIO()
    Console(file=written, width=width).print(drawn(cells, width))
    first, row, *others = written.getvalue().splitlines()
    assert first.replace("Δ ", "Δ").split() == head.split()
    by_name = dict(zip(["a", "b", "Δb", "c", "Δc"], numbers, strict=True))
    assert row.split()[2:] == [by_name[name] for name in head.split()[2:]]
    assert (LONG in row) != folds
    left_out = ", ".join(name for name in cells.head if name.replace(" ", "") not in head.split())
    assert others[-1:] == [f"(wider terminals show {left_out})"] or not left_out


def test_a_difference_keeps_keys_and_numbers_whole(
    measured: Store, shown: Callable[..., list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TTY_COMPATIBLE", "1")  # lines are broken for a terminal alone
    lines = shown(diff, "first", "second")
    text = " ".join(" ".join(lines).split())
    (key,) = re.findall(r"teacher: key (\w+) -> (\w+)", text)
    assert [len(digits) for digits in key] == [12, 12]
    assert f"metric {LONG}: 0.0123456 -> 0.654322 (+0.642)" in text
    assert "-1.23456e-09 -> -6.54322e-08 (-6.42e-08)" in text


@pytest.mark.parametrize("word", ["first", "first/teacher"])
def test_what_is_shown_of_a_run_keeps_keys_and_metrics_whole(
    measured: Store, shown: Callable[..., list[str]], word: str
) -> None:
    lines = shown(show, word)
    manifest = named(measured, "first/teacher").artifacts["teacher"].manifest
    heading = manifest.key if "/" in word else f"teacher {manifest.key[:12]}, made "
    for text in ("count 3", f"{LONG} 0.0123", f"other_{LONG} -1.23", heading):
        assert any(text in line for line in lines), text
    if "/" in word:
        text = " ".join(" ".join(lines).split())
        assert all(f"{name} {version}" in text for name, version in manifest.versions.items())
    else:
        stages = [line.split()[0] for line in lines if ", made " in line and ", took " in line]
        assert stages == ["rg-dataset", "rg-fit", "teacher", "distill", "eval", "export"]


def test_the_status_keeps_how_far_a_stage_is_and_every_recipe(measured: Store, shown: Callable[..., list[str]]) -> None:
    work = measured.runs.work / ("0123456789abcdef" * 4)
    work.mkdir(parents=True)
    record = {
        "stage": "teacher",
        "recipe": "quickstart-seed-0-use_rg-true-d06fd9",
        "key": work.name,
        "attempts": 2,
        "done": 35.0,
        "total": 100.0,
        "seconds": 7500.0,
        "updated": time.time() - 7500.0,
        "note": "12.3 s an episode, 5 % fall, level 1.23, KL 0.012, 4,500 steps/s",
        "metric": "episode_seconds",
        "curve": [[step, 0.25 * step] for step in range(200)],
    }
    (work / "progress.json").write_text(json.dumps(record))
    lines = shown(status)
    text = " ".join(" ".join(lines).split())
    assert "teacher of quickstart-seed-0-use_rg-true-d06fd9 (0123456789ab): stopped 2 h 05 min ago" in text
    assert "35 %, 2 h 05 min spent, attempt 2, 12.3 s an episode" in text
    (curve,) = [line.split() for line in lines if "█" in line]
    assert (curve[0], curve[-1]) == ("episode_seconds", "49.75")
    head = next(place for place, line in enumerate(lines) if line.startswith("recipe "))
    assert lines[head].split() == ["recipe", "finished", "stages", "last"]
    for recipe in ("first", "second"):
        (row,) = [line for line in lines[head:] if line.startswith(recipe)]
        assert "rg-dataset, rg-fit, teacher, distill, eval, export" in row
        assert row.endswith(" ago")


def test_differences_stand_stage_by_stage(folder: Path, command: Command) -> None:
    (folder / "third.yaml").write_text("extends: first.yaml\nseed: 4\n")
    assert command("run", "third.yaml", "--until", "rg-fit").returncode == 0
    lines = command("diff", "first", "third").stdout.splitlines()
    assert "seed: 3 -> 4" in lines
    places = [line.partition(":")[0] for line in lines if line.startswith("rg-")]
    assert places == sorted(places)
    (reads,) = [line.split() for line in lines if "input rg-dataset" in line]
    assert [len(digest) for digest in (reads[-3], reads[-1])] == [12, 12], "a digest is shown by its first characters"


@pytest.mark.parametrize("width", [WIDTH, 120])
def test_a_list_of_artifacts_keeps_every_column_whole(
    folder: Path, width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    store = Store(Runs(folder / "runs"))
    for artifact in store.artifacts("teacher"):
        metrics = {f"a_metric_with_a_name_of_its_own_{number}": 1.5 for number in range(3)}
        (artifact.folder / "summary.json").write_text(json.dumps({"metrics": metrics}))
    ls(runs=folder / "runs")
    lines = capsys.readouterr().out.splitlines()
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
        StagePlan(cast(Stage, SimpleNamespace(name=stage)), None, None, None, reasons=("new",), roughly=seconds)
        for stage, seconds in zip(stages, times, strict=True)
    ]
    written = io.StringIO()
    table = plan_table({name: steps}, what)
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
