"""The commands answer fast, say what was meant, and end with the right exit code."""

import json
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from function_calls import function_calls
from rich.console import Console
from sealing import sealed_anew

from iowbc.commands.compare import compare, report
from iowbc.commands.lookup import open_artifact, points_of
from iowbc.commands.playable import UNPLANNED, named_source
from iowbc.errors import UsageError
from iowbc.pipeline.store.artifact import write_manifest
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

SMALL_STAGES = Path(__file__).parents[1] / "pipeline" / "fake_stages.py"
Command = Callable[..., "subprocess.CompletedProcess[str]"]
Key = Callable[[str, str], str]


def test_help_answers_at_once() -> None:
    assert function_calls("-m", "iowbc", "--help") < 150_000


def test_a_wrong_recipe_fails_at_once(tmp_path: Path) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text("teacher:\n  stebs: 3\n")
    assert function_calls("-m", "iowbc", "run", str(path)) < 970_000


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["run", "wrong.yaml"], "wrong.yaml:2:3: key 'teacher.stebs' = 3"),
        (["plan", "nothing.yaml"], "no such file; recipes in .: first.yaml, second.yaml"),
        (["plan", "first.yaml", "--set", "seed"], "should read a.b.c=value"),
        (["run", "first.yaml", "--until", "taecher"], "valid: rg-dataset, rg-fit, teacher"),
        (["run", "first.yaml", "--set", "robot=r2d2"], "no robot 'r2d2'"),
        (["run", "first.yaml", "--workers", "0"], "workers"),
        (["run", "first.yaml", "--address", "auto"], "add --engine ray"),
        (["run"], "RECIPE"),
        (["fly"], "fly"),
        (["show", "thrid"], "neither a recipe that has run"),
        (["show", "first/nothing"], "finished: rg-dataset, rg-fit"),
        (["diff", "first", "thrid"], "neither a recipe that has run"),
        (["compare", "first"], "two or more"),
        (["compare", "first", "first"], "two or more"),
        (["compare", "first/eval", "second/eval"], "first/eval is one artifact; compare takes recipes"),
        (["run", "first.yaml", "--runs", "first.yaml"], "first.yaml is not a folder"),
        (["gc", "--unused", "--runs", "first.yaml"], "give another folder with --runs"),
        (["compare", "first", "second", "--output", "first.yaml"], "give another folder with --output"),
        (["report", "first", "--output", "folder.html"], "give the name of a file that ends in .html"),
        (["run", "caf\udce9.yaml"], "'caf\\udce9.yaml' is not utf-8 text"),
        (["ui", "--runs", "first.yaml"], "first.yaml cannot be written"),
        (["run", "first.yaml", "--until", "rg-fit", "--force", "teacher"], "teacher comes after rg-fit"),
        (["bench", "sim", "--runs", "first.yaml"], "first.yaml cannot be written"),
        (["ls", "techer"], "did you mean 'teacher'?"),
        (["gc"], "--unused"),
        (["gc", "--recipe", "frist"], "did you mean 'first'?"),
        (["gc", "--recipe", "first", "--runs", "empty"], "no such recipe that has run; valid: none"),
        (["play", "first/eval"], "stages that leave one: export, distill, teacher"),
        (["play", "first", "--scene", "lifft"], "did you mean 'lift'?"),
        (["bench", "fly"], "fly"),
        (["bench", "sim", "--scene", "lifft"], "valid: free, lift"),
    ],
)
def test_wrong_usage_ends_with_2_and_a_reason(folder: Path, command: Command, arguments: list[str], text: str) -> None:
    if "wrong.yaml" in arguments:
        (folder / "wrong.yaml").write_text("teacher:\n  stebs: 3\n")
    (folder / "folder.html").mkdir()
    done = command(*arguments)
    assert done.returncode == 2
    assert text in done.stderr
    assert "Traceback" not in done.stderr


def test_a_finished_recipe_is_cached_and_fast(folder: Path, command: Command) -> None:
    done = command("run", "first.yaml")
    assert done.returncode == 0
    assert done.stdout.count(": cached") == 6
    assert function_calls(str(SMALL_STAGES), "run", "first.yaml", folder=folder) < 1_940_000
    assert "all stages are cached" in command("plan", "first.yaml").stdout


def test_a_plan_gives_the_reasons_and_writes_nothing(folder: Path, command: Command) -> None:
    before = sorted(folder.rglob("*"))
    done = command("plan", "first.yaml", "--set", "eval.trials=9")
    assert done.returncode == 0
    assert "eval.trials (--set eval.trials=9): 5 -> 9" in " ".join(done.stdout.split())
    assert "1 stage would run" in done.stdout
    assert sorted(folder.rglob("*")) == before


def test_ls_lists_artifacts_and_who_uses_them(command: Command, key: Key) -> None:
    lines = command("ls").stdout.splitlines()
    teachers = [line for line in lines if line.lstrip().startswith("teacher")]
    assert {line.split()[1] for line in teachers} == {key(name, "teacher")[:12] for name in ("first", "second")}
    assert any("first, second" in line for line in lines)
    assert len(command("ls", "teacher").stdout.splitlines()) == 3


def test_show_tells_an_artifact_by_key_or_name(command: Command, key: Key) -> None:
    by_key = command("show", key("second", "teacher")[:8]).stdout
    assert "teacher.steps: 8192" in by_key
    assert "count 3" in by_key
    by_name = command("show", "second/teacher").stdout
    assert key("second", "teacher") in by_name
    assert "distill" in command("show", "second").stdout


def test_diff_names_fields_keys_and_metrics(folder: Path, command: Command, key: Key) -> None:
    lines = command("diff", "first", "second").stdout.splitlines()
    assert "teacher.steps: 4096 -> 8192" in lines
    assert f"teacher: key {key('first', 'teacher')[:12]} -> {key('second', 'teacher')[:12]}" in lines
    assert not any(line.startswith("rg-fit") for line in lines)
    assert "teacher: teacher.steps: 4096 -> 8192" in command("diff", "first/teacher", "second/teacher").stdout
    assert "(absent)" not in command("diff", "first", "second/teacher").stdout
    assert command("diff", "first", "first").stdout == "no difference\n"
    (folder / "third.yaml").write_text("extends: first.yaml\nseed: 8\n")
    assert "seed: 3 -> 8" in command("diff", "first", "third.yaml").stdout
    assert (
        "teacher.seed: None -> 1" in command("diff", "first", "full_seed_1").stdout
    )  # a recipe by its name, which has not run
    path = folder / "runs" / "recipes" / "first.json"
    record = json.loads(path.read_text())
    del record["recipe"]["distill"]["seed"]  # as written before there was such a field
    path.write_text(json.dumps(record))
    assert "distill.seed" not in command("diff", "first", "second").stdout


def test_compare_shows_only_what_differs_and_by_how_much_and_the_learning_curves(
    folder: Path, command: Command, key: Key
) -> None:
    for name, count in (("first", 3.0), ("second", 5.0)):
        artifact = folder / "runs" / "store" / "teacher" / key(name, "teacher")
        summary = {"metrics": {"count": count, "same": 1.0}}
        (artifact / "summary.json").write_text(json.dumps(summary))
        pd.DataFrame({"step": [1, 2], "reward": [0.0, count]}).to_parquet(artifact / "tables/learning_curves.parquet")
        if name == "first":
            refused = command("compare", "first", "second")
            assert "is damaged: summary.json" in refused.stderr
            assert not (folder / "runs" / "compare").exists() or not any((folder / "runs" / "compare").iterdir())
        sealed_anew(artifact)
    (folder / "runs" / "compare" / "paper").mkdir()
    (folder / "runs" / "compare" / "paper" / "runs.json").touch()
    done = command("compare", "first", "second")
    assert done.returncode == 0, done.stderr
    table = (folder / "runs" / "compare" / "metrics.md").read_text()
    assert table.splitlines()[0] == "| stage | metric | first | second | Δ second |"
    assert table.splitlines()[2:] == ["| teacher | count | 3 | 5 | +2 |"]
    assert "|" not in done.stdout
    written = ["runs/compare/metrics.md", "runs/compare/runs.json", "runs/compare/figures/ (1 file)"]
    assert done.stdout.splitlines()[-3:] == written
    assert (folder / "runs" / "compare" / "figures" / "learning_teacher.png").read_bytes().startswith(b"\x89PNG")
    assert done.stdout.index("teacher: reward [1/s]") < done.stdout.index("▁█ 3  first")
    assert "▁█ 5  second" in done.stdout


def test_gc_removes_what_it_is_told_to_and_nothing_else(folder: Path, command: Command, key: Key) -> None:
    teachers = folder / "runs" / "store" / "teacher"
    assert "would remove" in command("gc", "--recipe", "second", "--dry-run").stdout
    assert len(list(teachers.iterdir())) == 2
    assert command("gc", "--unused").stdout == "0 bytes in all\n"
    assert command("gc", "--recipe", "second", "--older-than", "1").stdout == "0 bytes in all\n"
    (folder / "runs" / "tracking").mkdir(exist_ok=True)
    (folder / "runs" / "tracking" / "20260101-empty-1.jsonl").touch()  # its disk was full at once
    (teachers / f".removing-{key('second', 'teacher')}" / "figures").mkdir(parents=True)  # its removal was killed
    (folder / "runs" / "work" / ".removing-1" / "out").mkdir(parents=True)
    assert "?" not in command("status").stdout
    assert command("gc", "--recipe", "second", "--work").returncode == 0
    assert command("gc", "--unused").returncode == 0
    assert not [*(folder / "runs" / "tracking").glob("*-empty-*"), *(folder / "runs" / "work").iterdir()]
    assert [path.name for path in teachers.iterdir()] == [key("first", "teacher")]
    assert "all stages are cached" in command("plan", "first.yaml").stdout


def test_a_run_with_overrides_leaves_the_recipes_name_to_what_it_had(folder: Path, command: Command, key: Key) -> None:
    before = key("first", "teacher")
    assert command("run", "first.yaml", "--set", "seed=4").returncode == 0
    assert key("first", "teacher") == before
    assert before in command("show", "first/teacher").stdout
    assert command("gc", "--unused").stdout == "0 bytes in all\n"
    assert command("run", "first.yaml", "--set", "seed=4").stdout.count(": cached") == 6
    assert command("run", "first.yaml").stdout.count(": cached") == 6


def test_a_name_stands_for_no_results_of_a_policy_that_was_trained_anew(
    folder: Path, command: Command, key: Key
) -> None:
    record, before = folder / "runs" / "recipes" / "first.json", key("first", "teacher")
    (folder / "first.yaml").write_text("seed: 4\nteacher:\n  steps: 4096\nexecution: {track: false}\n")
    assert command("run", "first.yaml", "--until", "teacher").returncode == 0
    assert key("first", "teacher") != before
    assert list(json.loads(record.read_text())["stages"]) == ["rg-dataset", "rg-fit", "teacher"]
    assert sorted(path.name for path in (folder / "runs" / "first").iterdir()) == ["rg-dataset", "rg-fit", "teacher"]
    (folder / "first.yaml").write_text("seed: 3\nteacher:\n  steps: 4096\nexecution: {track: false}\n")
    assert command("run", "first.yaml").stdout.count(": cached") == 6
    assert len(json.loads(record.read_text())["stages"]) == 6


def test_gc_removes_what_was_used_long_ago_only_when_told_how_long(folder: Path, command: Command, key: Key) -> None:
    assert command("run", "first.yaml", "--set", "seed=4").returncode == 0
    teachers = folder / "runs" / "store" / "teacher"
    assert len(list(teachers.iterdir())) == 3
    assert command("gc", "--unused", "--older-than", "1").stdout == "0 bytes in all\n"
    assert command("gc", "--unused", "--older-than", "1e-9").returncode == 0
    assert {path.name for path in teachers.iterdir()} == {key("first", "teacher"), key("second", "teacher")}


def test_gc_removes_what_is_newer_than_the_clock_says(folder: Path, command: Command) -> None:
    aside = folder / "runs" / "damaged" / "teacher-1"
    aside.mkdir(parents=True)
    os.utime(aside, (time.time() + 3600.0,) * 2)  # the clock was set back since
    assert "removed runs/damaged/teacher-1" in command("gc", "--damaged").stdout


def test_a_long_training_is_removed_by_its_recipes_name_alone(folder: Path, command: Command, key: Key) -> None:
    for record in (folder / "runs" / "recipes").glob("*.json"):
        record.unlink()
    store = Store(Runs(folder / "runs"))
    teachers = store.artifacts("teacher")
    write_manifest(teachers[0].folder, teachers[0].manifest.model_copy(update={"seconds": 7200.0}))
    assert command("gc", "--unused").returncode == 0
    assert [made.manifest.key for made in store.artifacts()] == [teachers[0].manifest.key]


def test_status_tells_what_each_recipe_has(command: Command) -> None:
    output = command("status").stdout
    assert "first" in output
    assert "rg-dataset, rg-fit, teacher, distill, eval, export" in output


def test_the_runs_folder_can_be_named_by_option_or_environment(
    folder: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = str(folder / "elsewhere")
    assert f"nothing has run in {other} yet" in command("status", "--runs", other).stdout.replace("\n", "")
    monkeypatch.setenv("IOWBC_RUNS", other)
    assert f"no artifact is stored in {other}/store yet" in command("ls").stdout.replace("\n", "")


def test_schema_is_written_for_editors(folder: Path, command: Command) -> None:
    printed = json.loads(command("schema").stdout)
    assert command("schema", "--output", "schema.json").returncode == 0
    assert json.loads((folder / "schema.json").read_text()) == printed
    assert printed["properties"]["teacher"]["$ref"] == "#/$defs/Teacher"


def test_the_output_may_be_cut_short(folder: Path) -> None:
    """`iowbc run ... | head -1` ends the reader, not the run."""
    command = f"{sys.executable} {SMALL_STAGES} run first.yaml --set seed=9"
    done = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command} | head -1"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    assert len(list((folder / "runs" / "store" / "export").iterdir())) == 2 + 1


def test_an_artifact_is_opened_from_python(folder: Path) -> None:
    artifact = open_artifact("second/teacher", folder / "runs")
    assert artifact.manifest.stage == "teacher"
    with pytest.raises(UsageError, match="first/teacher"):
        open_artifact("first", folder / "runs")


def test_a_damaged_record_of_a_recipe_is_named_and_keeps_gc_from_removing(folder: Path, command: Command) -> None:
    record = folder / "runs" / "recipes" / "first.json"
    record.write_text(record.read_text()[:40])
    arguments = (["show", "first"], ["diff", "first", "second"], ["play", "first"], ["gc", "--unused"])
    for done in (command(*words) for words in arguments):
        assert done.returncode == 2
        assert done.stderr == "runs/recipes/first.json is damaged; run the recipe again to remake it\n"
    for words in (["status"], ["ls"], ["status", "--json"]):
        done = command(*words)
        assert (done.returncode, done.stderr.count("first.json is damaged")) == (0, 1)
        assert "second" in done.stdout
    assert command("run", "first.yaml").stdout.count(": cached") == 6
    assert command("gc", "--unused").stdout == "0 bytes in all\n"


@pytest.mark.parametrize("text", ["[]", '{"points": 3}', '{"points": [{}]}', "[" * 100_000])
def test_a_record_of_a_sweep_of_other_types_is_none(tmp_path: Path, text: str) -> None:
    runs = Runs(tmp_path)
    (runs.sweeps / "wide").mkdir(parents=True)
    (runs.sweeps / "wide" / "sweep.json").write_text(text)
    assert points_of(Store(runs), ["wide"]) == ["wide"]


def test_a_sweep_of_which_nothing_has_finished_is_told(tmp_path: Path) -> None:
    runs = Runs(tmp_path)
    (runs.sweeps / "wide").mkdir(parents=True)
    (runs.sweeps / "wide" / "sweep.json").write_text('{"points": {"wide_a": {}, "wide_b": {}}}')
    with pytest.raises(UsageError, match="wide: none of wide_a, wide_b has finished a stage"):
        points_of(Store(runs), ["wide"])


def test_what_is_damaged_is_neither_played_nor_compared_nor_reported(folder: Path, key: Key) -> None:
    (folder / "runs" / "store" / "eval" / key("second", "eval") / "tables" / "counts.md").write_bytes(bytes(range(256)))
    store, console = Store(Runs(folder / "runs")), Console()
    with pytest.raises(UsageError, match=r"counts\.md has 256 bytes.*to make it anew: iowbc run"):
        compare(["first", "second"], folder / "compared", runs=folder / "runs")
    with pytest.raises(UsageError, match=r"counts\.md has 256 bytes.*to make it anew: iowbc run"):
        report(["second"], folder / "second.html", runs=folder / "runs")
    (folder / "runs" / "store" / "teacher" / key("second", "teacher") / "recipe.yaml").write_text("simulation: 3\n")
    with pytest.raises(UsageError, match=r"recipe\.yaml has 14 bytes.*to make it anew: iowbc run"):
        named_source(store, console, "second/teacher", None, "lift", UNPLANNED)


@pytest.mark.parametrize("stage", ["teacher", "rg-fit"])
def test_a_damaged_policy_or_generator_is_not_played(folder: Path, command: Command, key: Key, stage: str) -> None:
    damaged = folder / "runs" / "store" / stage / key("second", stage)
    (damaged / "result.json").write_text('{"seed": 8, "count": 3}')
    done = command("play", "second/teacher")
    assert done.returncode == 2
    assert f"{damaged.relative_to(folder)} is damaged: result.json differs from its digest" in done.stderr
    words = shlex.split(done.stderr.split("to make it anew: iowbc ")[1])
    assert command(*words).returncode == 0
    assert "differs from its digest" not in command("play", "second/teacher").stderr
