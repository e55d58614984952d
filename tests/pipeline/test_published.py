"""What was published with the repository is used like what was made here, and never changed."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from workplace import Workplace

from iowbc import files
from iowbc.commands.publish import LARGEST_REPOSITORY
from iowbc.pipeline.store import store


@pytest.fixture
def cloned(workplace: Workplace) -> Workplace:
    """All stages are published, and nothing was made here."""
    for artifact in workplace.run().values():
        workplace.store.publish(artifact)
    shutil.rmtree(workplace.store.runs.store)
    workplace.ran()
    return workplace


def test_a_fresh_clone_uses_what_is_published(cloned: Workplace) -> None:
    assert all(step.cached and step.artifact and step.artifact.published for step in cloned.plan().values())
    assert cloned.run()["eval"].metrics == {"count": 3.0}
    assert cloned.ran() == []
    assert "teacher: cached - published" in cloned.command("run", "small.yaml").output
    assert cloned.command("plan", "small.yaml").output.count("cached (published)") == 6


def test_a_change_leaves_it_behind_as_any_cached_artifact(cloned: Workplace) -> None:
    assert cloned.plan("eval.trials=9")["eval"].reasons == ("eval.trials (--set eval.trials=9): 5 -> 9",)
    cloned.run("eval.trials=9")
    assert cloned.ran() == ["eval"]
    cloned.run(force=frozenset({"teacher"}))
    assert cloned.ran() == ["teacher"]
    step = cloned.plan()["teacher"]
    assert step.cached
    assert step.artifact is not None
    assert not step.artifact.published


def test_a_damaged_one_is_named_ignored_and_left_alone(cloned: Workplace) -> None:
    (folder,) = (cloned.store.runs.published / "teacher").iterdir()
    (folder / "result.json").write_text("{}")
    step = cloned.plan()["teacher"]
    assert not step.cached
    assert step.notes == ("the published artifact is ignored, it is damaged: result.json has 2 bytes instead of 23",)
    cloned.run()
    assert cloned.ran() == ["teacher"]
    assert (folder / "result.json").read_text() == "{}"
    assert cloned.plan()["teacher"].cached


def test_what_leaves_out_its_large_files_stands_for_its_digest_alone(
    workplace: Workplace, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = workplace.run()
    monkeypatch.setattr(store, "LARGEST_FILE", 22)
    copy = workplace.store.publish(made["rg-fit"])
    assert "result.json" in copy.manifest.omitted
    monkeypatch.undo()
    for name in ("rg-dataset", "teacher", "distill", "eval", "export"):
        workplace.store.publish(made[name])
    for made_here in ("store", "recipes", "small"):
        shutil.rmtree(workplace.store.runs.root / made_here)
    workplace.ran()
    assert all(step.cached for step in workplace.plan().values())
    workplace.run("eval.trials=9")
    assert workplace.ran() == ["eval"]
    steps = workplace.plan("teacher.gamma=0.9")
    assert steps["rg-fit"].reasons == ("its published artifact leaves out large files; distill reads it",)
    assert steps["rg-fit"].expected is not None
    assert steps["rg-dataset"].cached
    workplace.run("teacher.gamma=0.9")
    assert workplace.ran() == ["rg-fit", "teacher"]
    (link,) = (workplace.store.runs.root / "small").glob("rg-fit*")
    assert (link / "result.json").is_file()


def test_a_missing_record_makes_nothing_anew(workplace: Workplace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "KINDS", (".json",))
    for artifact in workplace.run().values():
        assert workplace.store.publish(artifact).manifest.omitted == (
            "figures/curve.png",
            "tables/counts.md",
        )
    shutil.rmtree(workplace.store.runs.store)
    workplace.ran()
    workplace.run("eval.trials=9")
    assert workplace.ran() == ["eval"]


def test_a_published_training_is_gone_on_from_unless_it_lacks_what_that_takes(
    workplace: Workplace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store, "KINDS", (".json",))
    for artifact in workplace.run().values():
        workplace.store.publish(artifact)
    shutil.rmtree(workplace.store.runs.store)
    teacher = workplace.registry["teacher"]
    for needed, found in (("result.json", True), ("figures/curve.png", False)):
        workplace.registry["teacher"] = replace(teacher, extends="teacher.steps", extends_from=(needed,))
        step = workplace.plan("teacher.steps=8192")["teacher"]
        assert (step.predecessor is not None) == found


def test_publishing_copies_verifies_and_refuses_what_has_not_run(workplace: Workplace) -> None:
    refused = workplace.command("publish", "small.yaml")
    assert refused.code == 2
    assert "not finished: small (rg-dataset, rg-fit, teacher, distill, eval, export)" in refused.errors
    workplace.run(until="teacher")
    done = workplace.command("publish", "small.yaml", "--until", "teacher")
    assert done.code == 0, done.errors
    assert "teacher: runs/published/teacher/" in done.output
    shutil.rmtree(workplace.store.runs.store)
    assert "cached (published)" in workplace.command("plan", "small.yaml", "--until", "teacher").output


def test_publishing_into_a_file_is_refused_before_anything_is_copied(workplace: Workplace) -> None:
    workplace.run()
    workplace.store.runs.published.write_text("")
    refused = workplace.command("publish", "small.yaml")
    assert refused.code == 2
    assert "published is not a folder" in refused.errors


def test_publishing_leaves_out_the_files_that_are_named(workplace: Workplace) -> None:
    workplace.run()
    unknown = workplace.command("publish", "small.yaml", "--without", "curve.png")
    assert unknown.code == 2
    assert "--without curve.png: no artifact has such a file; did you mean 'figures/curve.png'?" in unknown.errors
    assert not workplace.store.runs.published.exists()
    assert workplace.command("publish", "small.yaml").code == 0
    shutil.rmtree(workplace.store.runs.store)
    assert list(workplace.store.runs.published.glob("*/*/figures/curve.png"))
    done = workplace.command("publish", "small.yaml", "--without", "figures/curve.png")
    assert done.output.count("; without 1 of ") == 6
    assert not list(workplace.store.runs.published.glob("*/*/figures/curve.png"))
    assert all(step.cached for step in workplace.plan().values())


def test_a_repository_that_grows_too_large_is_warned_of(cloned: Workplace) -> None:
    with (cloned.store.runs.published / "large").open("wb") as large:
        large.truncate(LARGEST_REPOSITORY)
    done = cloned.command("publish", "small.yaml")
    assert done.code == 0
    assert "warning: a repository should carry no more than 30.0 MB; remove what is out of date" in done.output


def test_publishing_brings_back_what_a_death_left_and_removes_the_rest(
    cloned: Workplace, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs, published = cloned.store.runs, cloned.store.find_any
    teacher, fit = (next((runs.published / stage).iterdir()) for stage in ("teacher", "rg-fit"))
    artifact, other = published("teacher", teacher.name), published("rg-fit", fit.name)
    assert artifact is not None
    assert other is not None

    def dies(source: object, target: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(files, "move_folder", dies)
    with pytest.raises(KeyboardInterrupt):
        cloned.store.publish(artifact)
    monkeypatch.undo()
    (teacher.parent / f".{'a' * 64}.4711").mkdir()
    assert {path.name for path in teacher.parent.iterdir()} == {
        f".{teacher.name}.old",
        f".{teacher.name}.new",
        f".{'a' * 64}.4711",
    }
    ignored = ["git", "check-ignore", "-q", "--no-index", f"../../runs/published/teacher/.{teacher.name}.old"]
    assert subprocess.run(ignored, cwd=Path(__file__).parent, check=False).returncode == 0
    removed = cloned.command("gc", "--unused").output
    assert removed.count("removed") == 2
    assert f".{teacher.name}.old" not in removed
    cloned.store.publish(other)
    assert [path.name for path in teacher.parent.iterdir()] == [teacher.name]
    again = published("teacher", teacher.name)
    assert again is not None
    again.verify()


def test_two_processes_publish_one_after_the_other(cloned: Workplace) -> None:
    cloned.run(force=frozenset({"teacher"}))
    both = [cloned.start("publish", "small.yaml") for _ in range(2)]
    assert [one.finish() for one in both] == [0, 0], both[0].errors + both[1].errors
    assert not list(cloned.store.runs.published.glob("*/.*"))
    assert all(step.cached for step in cloned.plan().values())
