"""A stage that begins from an artifact which another recipe made."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from workplace import Workplace

from iowbc.errors import RecipeError
from iowbc.pipeline.stage import START, Job
from iowbc.pipeline.store.publishing import publish


@pytest.fixture
def told(workplace: Workplace) -> list[Path | None]:
    """Where the teacher's jobs are told to begin; the teacher takes `teacher.start`."""
    found: list[Path | None] = []
    teacher = workplace.registry["teacher"]

    def run(job: Job) -> None:
        found.append(job.inputs.get(START))
        teacher.run(job)

    workplace.registry["teacher"] = replace(
        teacher, run=run, starts_from="teacher.start", extends="teacher.steps", extends_from=("started_at.json",)
    )
    return found


def test_it_begins_from_the_artifact_whose_key_the_recipe_gives(workplace: Workplace, told: list[Path | None]) -> None:
    first = workplace.run()["teacher"]
    start = f"teacher.start={first.manifest.key[:8]}"
    step = workplace.plan(start, "teacher.gamma=0.9")["teacher"]
    assert not step.cached
    assert step.predecessor is None
    assert f"teacher.start (--set {start}): (absent) -> '{first.manifest.key[:8]}'" in step.reasons
    second = workplace.run(start, "teacher.gamma=0.9")["teacher"]
    assert told == [None, first.folder]
    assert second.ingredients["inputs"][START] == first.manifest.digest
    assert workplace.plan(start, "teacher.gamma=0.9")["teacher"].cached
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


def test_what_was_published_without_its_state_begins_nothing_but_is_known(
    workplace: Workplace, told: list[Path | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = workplace.run()["teacher"]
    start = f"teacher.start={first.manifest.key}"
    second = workplace.run(start)["teacher"]
    monkeypatch.setattr("iowbc.pipeline.store.publishing.KINDS", frozenset())
    for artifact in (first, second):
        publish(workplace.store.runs, artifact)
        shutil.rmtree(artifact.folder)
    assert workplace.plan(start)["teacher"].artifact == workplace.store.find_published("teacher", second.manifest.key)
    with pytest.raises(RecipeError, match=r"was published without started_at.json; make it here"):
        workplace.plan(start, "teacher.gamma=0.9")
