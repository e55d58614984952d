"""A recipe of recipes runs each, shares what they share, and compares them."""

import subprocess
from collections.abc import Callable
from pathlib import Path

from iowbc.commands.compared import film_of, record
from iowbc.commands.swept import points_of
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store

Command = Callable[..., "subprocess.CompletedProcess[str]"]


def write_study(folder: Path) -> None:
    (folder / "third.yaml").write_text("extends: first.yaml\neval: {trials: 3}\n")
    (folder / "both.yaml").write_text("variants: [first, third]\n")


def test_each_variant_runs_once_and_they_are_compared(folder: Path, command: Command) -> None:
    write_study(folder)
    planned = command("plan", "both.yaml").stdout
    assert planned.index("first:") < planned.index("all stages are cached") < planned.index("third:")
    assert "2 stages would run" in planned  # eval for its trials, export for its name
    done = command("run", "both.yaml")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count(": runs - ") == 2
    compared = (folder / "runs" / "compare" / "both" / "metrics.md").read_text().splitlines()
    assert compared[0].startswith("| stage | metric | first | third |")
    assert len(compared) == 2, "the made-up stages count alike, and what is alike is left out"
    assert command("run", "both.yaml").stdout.count(": cached") == 12
    assert "next:\n  iowbc report both" in done.stdout
    store = Store(Runs(folder / "runs"))
    assert points_of(store, ["both"]) == ["first", "third"], "later commands know them by the recipe's name"
    assert points_of(store, ["first", "nobody"]) == ["first", "nobody"]


def test_an_earlier_end_is_compared_with_nothing(folder: Path, command: Command) -> None:
    write_study(folder)
    assert command("run", "both.yaml", "--until", "teacher").returncode == 0
    assert not (folder / "runs" / "compare").exists()


def test_forcing_a_stage_of_all_variants_is_refused(folder: Path, command: Command) -> None:
    write_study(folder)
    done = command("run", "both.yaml", "--force", "teacher")
    assert done.returncode == 2
    assert "force it in one of them: first.yaml, third.yaml" in done.stderr


def test_a_wrong_variant_is_named_before_any_runs(folder: Path, command: Command) -> None:
    write_study(folder)
    (folder / "third.yaml").write_text("extends: first.yaml\neval: {trails: 3}\n")
    done = command("run", "both.yaml")
    assert done.returncode == 2
    assert "third.yaml:2:8: key 'eval.trails' = 3" in done.stderr


def test_the_film_of_a_comparison_is_found_by_its_runs_in_any_order(tmp_path: Path) -> None:
    runs = Runs(tmp_path)
    folder = runs.compared / "both"
    folder.mkdir(parents=True)
    record(["first", "third"], folder)
    assert film_of(runs, ["first", "third"]) is None, "none was made"
    (folder / "side_by_side.mp4").write_bytes(b"film")
    assert film_of(runs, ["third", "first"]) == folder / "side_by_side.mp4"
    assert film_of(runs, ["first"]) is None
