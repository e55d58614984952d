"""A stage that begins from an artifact which another recipe made."""

import json
import re
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from workplace import RECIPE, Workplace

from iowbc.errors import RecipeError
from iowbc.pipeline.planner import Planner, planner_for
from iowbc.pipeline.stage import START, Job, Stage
from iowbc.pipeline.stage_plan import Options, StagePlan
from iowbc.pipeline.store.artifact import INGREDIENTS
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import load_recipe
from iowbc.robot.description import robot_folder
from iowbc.stages.registry import STAGES


@pytest.fixture
def told(workplace: Workplace) -> list[Path | None]:
    """Where the teacher's jobs are told to begin."""
    found: list[Path | None] = []
    teacher = workplace.registry["teacher"]

    def run(job: Job) -> None:
        found.append(job.inputs.get(START))
        teacher.run(job)

    workplace.registry["teacher"] = replace(
        teacher, run=run, extends="teacher.steps", extends_from=("started_at.json",)
    )
    return found


def test_it_begins_from_the_artifact_whose_key_the_recipe_gives(workplace: Workplace, told: list[Path | None]) -> None:
    first = workplace.run()["teacher"]
    start = f"teacher.start={first.manifest.key[:8]}"
    step = workplace.plan(start, "teacher.gamma=0.9")["teacher"]
    assert not step.cached
    assert step.predecessor is None
    assert "start is read now" in step.reasons
    second = workplace.run(start, "teacher.gamma=0.9")["teacher"]
    assert told == [None, first.folder]
    assert second.ingredients["inputs"][START] == first.manifest.digest
    longer = f"teacher.start={first.manifest.key}"
    assert workplace.plan(longer, "teacher.gamma=0.9")["teacher"].cached, "what it is called decides nothing"
    assert not workplace.plan("teacher.gamma=0.9")["teacher"].cached


def test_a_longer_one_with_the_same_beginning_goes_on_from_its_end(
    workplace: Workplace, told: list[Path | None]
) -> None:
    start = f"teacher.start={workplace.run()['teacher'].manifest.key}"
    second = workplace.run(start)["teacher"]
    assert workplace.plan(start, "teacher.steps=8192")["teacher"].predecessor == second


def test_a_beginning_that_is_not_stored_is_refused_before_anything_runs(
    workplace: Workplace, told: list[Path | None]
) -> None:
    with pytest.raises(RecipeError, match=r"--set .*key 'teacher.start' = 'ffffffff'.*begins none; `iowbc ls`"):
        workplace.run("teacher.start=ffffffff")
    assert told == []


def test_a_damaged_beginning_is_refused(workplace: Workplace, told: list[Path | None]) -> None:
    first = workplace.run()["teacher"]
    (first.folder / "result.json").write_text("damaged")
    with pytest.raises(RecipeError, match="is damaged: "):
        workplace.plan(f"teacher.start={first.manifest.key}")


def test_what_was_published_without_its_state_begins_one_all_the_same(
    workplace: Workplace, told: list[Path | None]
) -> None:
    first = workplace.run()["teacher"]
    start = f"teacher.start={first.manifest.key}"
    workplace.store.publish(first, ["started_at.json"])
    shutil.rmtree(first.folder)
    second = workplace.run(start, "teacher.gamma=0.9")["teacher"]
    found = workplace.store.find("teacher", first.manifest.key, published=True)
    assert found is not None
    assert told == [None, found.folder]
    assert second.ingredients["inputs"][START] == first.manifest.digest


def test_what_was_published_without_its_results_begins_none_by_its_key(workplace: Workplace) -> None:
    first = workplace.run()["teacher"]
    workplace.store.publish(first, ["result.json"])
    shutil.rmtree(first.folder)
    assert workplace.plan()["teacher"].cached
    with pytest.raises(RecipeError, match=r"key 'teacher.start' = .*: its published artifact leaves out large files"):
        workplace.plan(f"teacher.start={first.manifest.key}", "teacher.gamma=0.9")


@pytest.fixture
def second(workplace: Workplace) -> str:
    """A recipe whose teacher begins from that of small.yaml."""
    text = "extends: small.yaml\nteacher: {start: small.yaml, gamma: 0.9}\n"
    (workplace.folder / "second.yaml").write_text(text)
    return "second.yaml"


def test_the_recipe_that_it_begins_from_runs_first_where_it_has_not(workplace: Workplace, second: str) -> None:
    refused = workplace.command("sweep", second, "--until", "teacher", "--set", "seed=3..4")
    assert refused.code == 2
    assert "first\n  iowbc run small.yaml --until teacher\n" in refused.errors
    planned = workplace.command("plan", second, "--until", "teacher")
    assert planned.code == 0, planned.errors
    assert [word in planned.output for word in ("small", "second")] == [True, True]
    made = workplace.command("run", second, "--until", "teacher")
    assert made.code == 0, made.errors
    headings = [line for line in made.output.splitlines() if line in ("small:", "second:")]
    assert headings == ["small:", "second:"]
    assert "small" not in workplace.command("plan", second, "--until", "teacher").output
    loaded = workplace.planner().plan()
    assert [step.cached for step in loaded[:3]] == [True, True, True], "an ordinary run of the first recipe"


def test_the_recipe_that_it_begins_from_runs_again_where_it_was_published_without_results(
    workplace: Workplace, second: str
) -> None:
    made = workplace.command("run", second, "--until", "teacher")
    assert made.code == 0, made.errors
    for artifact in workplace.store.artifacts("teacher"):
        workplace.store.publish(artifact, ["result.json"])
    shutil.rmtree(workplace.store.runs.store / "teacher")
    assert "all stages are cached" in workplace.command("plan", second, "--until", "teacher").output
    later = workplace.command("plan", second).output
    assert re.search(r"^small .* cached +cached +[0-9.]+ s", later, re.MULTILINE), "its distill reads second's teacher"
    refused = workplace.command("sweep", second, "--until", "teacher", "--set", "teacher.gamma=0.8,0.7")
    assert refused.code == 2
    (command,) = [line for line in refused.errors.splitlines() if "iowbc run" in line]
    assert sorted(command.split()) == ["--force", "--until", "iowbc", "run", "small.yaml", "teacher", "teacher"]
    again = workplace.command("run", second, "--until", "teacher", "--force", "teacher")
    assert again.code == 0, again.errors
    assert [line for line in again.output.splitlines() if line in ("small:", "second:")] == ["small:", "second:"]
    made_here = [one for one in workplace.store.artifacts("teacher") if not one.published]
    assert [one.whole for one in made_here] == [True, True]


def test_recipes_that_begin_from_each_other_are_refused(workplace: Workplace, second: str) -> None:
    small = workplace.recipe.read_text()
    workplace.recipe.write_text(small.replace("steps: 4096", "steps: 4096\n  start: second.yaml"))
    with pytest.raises(RecipeError, match=r"second.yaml:2:11: key 'teacher.start' = 'small.yaml': begins from itself"):
        workplace.plan()


def test_what_overrides_change_may_begin_from_the_recipe_itself(workplace: Workplace) -> None:
    words = ("small.yaml", "--set", "teacher.start=small.yaml", "--set", "teacher.gamma=0.9", "--json")
    planned = json.loads(workplace.command("plan", *words).output)
    assert [one["recipe"] for one in planned] == ["small", "small"]
    first = workplace.run()["teacher"]
    second = workplace.run("teacher.start=small.yaml", "teacher.gamma=0.9")["teacher"]
    assert second.ingredients["inputs"][START] == first.manifest.digest


def test_a_recipe_that_is_not_there_is_refused_with_its_place(workplace: Workplace) -> None:
    workplace.recipe.write_text(RECIPE.replace("steps: 4096", "steps: 4096\n  start: secnd.yaml"))
    with pytest.raises(RecipeError, match=r"small\.yaml:4:\d+: key 'teacher.start' = 'secnd\.yaml': .*no such file"):
        workplace.plan()


def test_a_recipe_that_several_begin_from_is_planned_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decided, decide = Counter[tuple[Path, str | None, str]](), Planner.decide

    def counted(self: Planner, stage: Stage, inputs: Any) -> StagePlan:
        decided[self.loaded.file, self.options.until, stage.name] += 1
        return decide(self, stage, inputs)

    monkeypatch.setattr(Planner, "decide", counted)
    experts = load_recipe(Path(__file__).parents[2] / "recipes" / "experts" / "quick.yaml")
    planner_for(experts, STAGES, Store(Runs(tmp_path)), robot_folder("g1"), Options()).plan()
    assert len(decided) > 20
    assert set(decided.values()) == {1}


def test_gc_keeps_what_an_interrupted_training_begins_from(workplace: Workplace, second: str) -> None:
    first = workplace.run()["teacher"]
    assert workplace.command("run", "small.yaml").code == 0
    attempt = workplace.store.runs.work / "0123"
    attempt.mkdir(parents=True)
    (attempt / INGREDIENTS).write_text(json.dumps({"inputs": {START: first.manifest.digest}}))
    assert "runs/store/teacher" not in workplace.command("gc", "--recipe", "small", "--dry-run").output
    assert "runs/store/teacher" in workplace.command("gc", "--recipe", "small", "--work", "--dry-run").output


def test_gc_keeps_what_another_recipe_begins_from(workplace: Workplace, second: str) -> None:
    assert workplace.command("run", second).code == 0
    assert workplace.command("run", "small.yaml").code == 0
    removed = workplace.command("gc", "--recipe", "small").output
    assert "removed runs/recipes/small.json" in removed
    assert "runs/store/teacher" not in removed
    assert "all stages are cached" in workplace.command("plan", second).output
