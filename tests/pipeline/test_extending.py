"""A stage whose work only ends later goes on from what it has finished."""

from dataclasses import replace
from pathlib import Path

import pytest
from workplace import Workplace

from iowbc.pipeline.stage import Job


def extending(workplace: Workplace) -> list[Path | None]:
    """Lets the teacher extend `teacher.steps`; returns what its jobs are told to go on from."""
    told: list[Path | None] = []
    teacher = workplace.registry["teacher"]

    def run(job: Job) -> None:
        told.append(job.predecessor)
        teacher.run(job)

    workplace.registry["teacher"] = replace(teacher, run=run, extends="teacher.steps")
    return told


def test_a_greater_number_goes_on_from_the_finished_artifact(workplace: Workplace) -> None:
    told = extending(workplace)
    first = workplace.run()["teacher"]
    step = workplace.plan("teacher.steps=8192")["teacher"]
    assert not step.cached
    assert step.predecessor == first
    assert f"extends {first.manifest.key[:8]}, which ends earlier" in step.notes
    second = workplace.run("teacher.steps=8192")["teacher"]
    assert told == [None, first.folder]
    assert second.manifest.seconds > first.manifest.seconds, "the time from nothing, by which another one is reckoned"


def test_of_several_it_goes_on_from_the_latest_that_is_whole(workplace: Workplace) -> None:
    told = extending(workplace)
    first = workplace.run()["teacher"]
    second = workplace.run("teacher.steps=8192")["teacher"]
    assert workplace.plan("teacher.steps=9000")["teacher"].predecessor == second
    (second.folder / "result.json").write_text("damaged")
    assert workplace.plan("teacher.steps=9000")["teacher"].predecessor == first
    assert told == [None, first.folder]


def test_nothing_else_may_differ_and_the_end_must_be_later(workplace: Workplace) -> None:
    extending(workplace)
    workplace.run()
    assert workplace.plan("teacher.steps=8192", "teacher.gamma=0.9")["teacher"].predecessor is None
    assert workplace.plan("teacher.steps=2048")["teacher"].predecessor is None
    assert workplace.plan("teacher.steps=8192", force=frozenset({"teacher"}))["teacher"].predecessor is None


def test_a_training_by_other_code_is_extended_with_a_note_or_not_where_code_is_to_run_again(
    workplace: Workplace, monkeypatch: pytest.MonkeyPatch
) -> None:
    extending(workplace)
    first = workplace.run()["teacher"]
    monkeypatch.setattr("iowbc.pipeline.planner.changed_code", lambda old, new: ["learning"])
    step = workplace.plan("teacher.steps=8192")["teacher"]
    assert step.predecessor == first
    assert any(note.endswith("which ends earlier; code changed since it was made: learning") for note in step.notes)
    assert workplace.plan("teacher.steps=8192", on_code_change="rerun")["teacher"].predecessor is None
