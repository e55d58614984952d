"""A study runs each, shares what they share, and compares them."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from made_up_trials import trials_of

from iowbc.commands.compare import _joined, report_joint
from iowbc.commands.lookup import film_of, points_of, start_comparison
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.report.runs import Group, Run, grouped, metrics_table

Command = Callable[..., "subprocess.CompletedProcess[str]"]


def write_study(folder: Path) -> None:
    (folder / "third.yaml").write_text("extends: first.yaml\neval: {trials: 3}\n")
    (folder / "both.yaml").write_text("variants: [first, third]\n")


def test_each_variant_runs_once_and_they_are_compared(folder: Path, command: Command) -> None:
    write_study(folder)
    planned = command("plan", "both.yaml").stdout
    rows = [line.split() for line in planned.splitlines()]
    assert rows[0] == ["recipe", "rg-dataset", "rg-fit", "teacher", "distill", "eval", "export"]
    assert rows[1] == ["first", *["cached"] * 6]
    assert rows[2][:5] == ["third", *["cached"] * 4]
    assert rows[2][5].replace(".", "").isdigit(), "eval has more trials: its rate is known"
    assert rows[2][7].startswith("~"), "export has another name: its time is like that of the other"
    assert "2 recipes: 2 stages would run, 0 are shared, 10 cached; a guess: " in planned
    assert "`iowbc plan third.yaml` says why" in planned
    done = command("run", "both.yaml")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count(": runs - ") == 2
    compared = (folder / "runs" / "compare" / "both" / "metrics.md").read_text().splitlines()
    assert compared[0].startswith("| stage | metric | first | third |")
    assert len(compared) == 2, "the made-up stages count alike, and what is alike is left out"
    assert command("run", "both.yaml").stdout.count(": cached") == 12
    assert "next:\n  iowbc report both" in done.stdout
    planned = command("plan", "both.yaml", "--set", "eval.trials=9").stdout
    assert planned.endswith("`iowbc plan third.yaml --set eval.trials=9` says why; so for first\n")
    changed = command("run", "both.yaml", "--set", "eval.trials=9")
    assert changed.returncode == 0, changed.stderr
    assert "iowbc report both" not in changed.stdout, "the names stand for the runs without overrides"
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


def test_a_part_of_the_variants_is_compared_and_the_rest_named(folder: Path, command: Command) -> None:
    write_study(folder)
    done = command("compare", "both.yaml")
    assert done.returncode == 0, done.stderr
    assert "not compared, for their eval has not run: first, third; `iowbc plan both.yaml` says how long" in done.stdout
    assert (folder / "runs" / "compare" / "both" / "metrics.md").is_file()


def test_a_second_training_shares_the_reference_generator(folder: Path, command: Command) -> None:
    (folder / "again.yaml").write_text("extends: first.yaml\nteacher: {seed: 7}\ndistill: {seed: 7}\n")
    planned = command("plan", "again.yaml").stdout
    assert "rg-fit      cached" in planned
    assert "teacher.seed (again.yaml:2:11): (absent) -> 7" in planned


def evaluated(folder: Path, name: str, label: str, error: float, seed: int | None, steps: int) -> Run:
    """A run whose trials have these errors."""
    made = {"eval": {"label": label, "success": {"capacity_rate": 0.8}}}
    artifact = SimpleNamespace(folder=folder / name, recipe=made, metrics={}, ingredients={})
    artifact.folder.mkdir()
    trials_of(label, "lifting", {0.0: 5, 4.0: 5}, error=error).to_parquet(artifact.folder / "trials.parquet")
    teacher = {"steps": steps} if seed is None else {"steps": steps, "seed": seed}
    recipe = {"name": name, "seed": 3, "stages": ["teacher", "eval"], "teacher": teacher, "eval": {"label": label}}
    return Run(name, {"eval": artifact}, recipe)


def test_trainings_that_differ_in_their_seeds_alone_are_one_variant(tmp_path: Path) -> None:
    runs = [
        evaluated(tmp_path, "full", "IO-WBC", 0.1, None, 4096),
        evaluated(tmp_path, "again", "IO-WBC", 0.2, 7, 4096),
        evaluated(tmp_path, "longer", "IO-WBC", 0.4, None, 8192),
    ]
    report_joint(runs, tmp_path, ["never"])
    tables = tmp_path / "tables"
    lifting = (tables / "lifting.md").read_text()
    assert "| 0 kg | full | 0.350 ± " in lifting, "of ten trials; the label belongs to another recipe as well"
    assert "(full: 2 trainings)" in lifting
    assert "| longer | 0.600 ± " in lifting
    assert "| full, seed 7 | 1 | 10 | 100 % " in (tables / "interquartile.md").read_text()
    trainings = (tables / "trainings.md").read_text()
    assert "not all with the same budget of PPO. Missing: never." in trainings
    assert trainings.splitlines()[4:] == [
        "| full | IO-WBC | 3 | 4,096 | – |",
        "| again | IO-WBC | 7 | 4,096 | – |",
        "| longer | IO-WBC | 3 | 8,192 | – |",
        "| never | not evaluated yet | – | – | – |",
    ]


def test_a_label_that_is_the_name_of_another_recipe_is_replaced(tmp_path: Path) -> None:
    runs = [evaluated(tmp_path, name, "IO-WBC", error, None, 4096) for name, error in (("one", 0.1), ("two", 0.2))]
    runs[1].recipe["teacher"] = {"steps": 4096, "gamma": 0.9}  # type: ignore[index]
    named = evaluated(tmp_path, "three", "one", 0.4, None, 8192)
    report_joint([*runs, named], tmp_path)
    lifting = (tmp_path / "tables" / "lifting.md").read_text()
    assert [f"| {name} | 0." in lifting for name in ("one", "two", "three")] == [True, True, True]


def test_metrics_with_equal_values_of_other_frequency_differ() -> None:
    def group(name: str, values: tuple[float, ...]) -> Group:
        runs = [Run(name, {"eval": SimpleNamespace(metrics={"succeeded": value})}) for value in values]  # type: ignore[dict-item]
        return Group(name, tuple(runs))

    often, seldom, once = group("a", (20.0, 20.0, 10.0)), group("b", (10.0, 20.0, 10.0)), group("c", (20.0, 10.0))
    assert [len(metrics_table([often, other]).rows) for other in (seldom, once, often)] == [1, 0, 0]


def test_an_evaluation_that_two_recipes_share_counts_once(tmp_path: Path) -> None:
    full = evaluated(tmp_path, "full", "IO-WBC", 0.1, None, 4096)
    other = evaluated(tmp_path, "other", "WBC", 0.2, None, 8192)
    report_joint([full, Run("full.yaml", full.artifacts, full.recipe), other], tmp_path)
    lifting = (tmp_path / "tables" / "lifting.md").read_text()
    assert ("| 5/5 | 5/5 |" in lifting, "trainings" in lifting) == (True, False)


def test_a_report_has_the_tables_of_the_only_run_with_trials_beside_a_probe(tmp_path: Path) -> None:
    full, probed = (evaluated(tmp_path, name, name, 0.1, None, 4096) for name in ("full", "probed"))
    (probed.artifacts["eval"].folder / "trials.parquet").unlink()
    tables, _ = _joined(Store(Runs(tmp_path / "runs")), [full, probed])
    assert {"lifting", "capacity"} <= {table.name for table in tables}


def test_trainings_whose_recipes_different_versions_wrote_down_are_told_by_what_decided_them(tmp_path: Path) -> None:
    older, newer, other = (evaluated(tmp_path, name, "IO-WBC", 0.1, None, 4096) for name in ("older", "newer", "other"))
    cast(dict[str, Any], newer.recipe)["eval"]["added"] = "a default that the older version did not know"
    for run, seed, gamma in ((older, 0, 0.99), (newer, 7, 0.99), (other, 0, 0.9)):
        decided = {"recipe": {"seed": 3, "teacher": {"seed": seed, "gamma": gamma}}}
        cast(SimpleNamespace, run.artifacts["eval"]).ingredients = decided
    cast(dict[str, Any], other.recipe)["teacher"] = {"steps": 4096, "gamma": 0.9}
    groups = grouped([older, newer, other])
    assert [len(group.runs) for group in groups] == [2, 1]


def test_the_film_of_a_comparison_is_found_by_its_runs_in_any_order(tmp_path: Path) -> None:
    runs = Runs(tmp_path)
    folder = runs.compared / "both"
    folder.mkdir(parents=True)
    start_comparison(["first", "third"], folder)
    assert film_of(runs, ["first", "third"]) is None, "none was made"
    (folder / "side_by_side.mp4").write_bytes(b"film")
    assert film_of(runs, ["third", "first"]) == folder / "side_by_side.mp4"
    assert film_of(runs, ["first"]) is None


def test_a_new_comparison_of_the_same_runs_keeps_their_film_and_one_of_others_removes_it(tmp_path: Path) -> None:
    runs = Runs(tmp_path)
    folder = runs.compared
    (folder / "tables").mkdir(parents=True)
    start_comparison(["first", "third"], folder)
    (folder / "side_by_side.mp4").write_bytes(b"film")
    (folder / "tables" / "old.md").touch()
    start_comparison(["third", "first"], folder)
    assert film_of(runs, ["first", "third"]) == folder / "side_by_side.mp4"
    assert not (folder / "tables").exists()
    start_comparison(["first", "second"], folder)
    assert film_of(runs, ["first", "second"]) is None
