"""Artifacts are published whole or not at all, and damage is noticed."""

import dataclasses
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from workplace import Workplace

from iowbc import files
from iowbc.errors import Damaged, Interrupted, PipelineFailed
from iowbc.files import data_digest
from iowbc.pipeline.store.artifact import INGREDIENTS, MANIFEST
from iowbc.pipeline.store.last_used import ever_used, record_path
from iowbc.pipeline.store.locks import key_lock
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import PROGRESS, Workspace


def flip(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[3] ^= 1
    path.write_bytes(content)


def shorten(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


DAMAGES: dict[str, Callable[[Path], None]] = {
    "a changed byte": lambda folder: flip(folder / "result.json"),
    "a short file": lambda folder: shorten(folder / "result.json"),
    "a missing file": lambda folder: (folder / "result.json").unlink(),
    "no manifest": lambda folder: (folder / MANIFEST).unlink(),
    "half a manifest": lambda folder: shorten(folder / MANIFEST),
}


@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES.keys())
def test_a_damaged_artifact_is_set_aside_and_made_anew(workplace: Workplace, damage: Callable[[Path], None]) -> None:
    folder = workplace.run()["teacher"].folder
    workplace.ran()
    damage(folder)
    step = workplace.plan()["teacher"]
    assert not step.cached
    assert step.reasons[0].startswith("damaged: ")
    again = workplace.run()["teacher"]
    assert workplace.ran() == ["teacher"]
    assert len(list(workplace.store.runs.damaged.iterdir())) == 1
    assert any("set aside" in line for line in workplace.display.lines)
    again.verify()
    assert all(step.cached for step in workplace.plan().values())


def test_a_manifest_that_belongs_elsewhere_is_damage(workplace: Workplace) -> None:
    made = workplace.run()
    shutil.copy(made["eval"].folder / MANIFEST, made["teacher"].folder / MANIFEST)
    with pytest.raises(Damaged, match="belongs to eval"):
        workplace.store.find("teacher", made["teacher"].manifest.key)


def test_every_file_of_a_stage_is_in_the_manifest(workplace: Workplace) -> None:
    artifact = workplace.run()["teacher"]
    files = {"figures/curve.png", "result.json", "started_at.json", "summary.json", "tables/counts.md"}
    assert set(artifact.manifest.files) == files
    assert artifact.metrics == {"count": 3.0}
    assert artifact.ingredients["recipe"]["teacher"]["steps"] == 4096


def test_records_decide_no_later_key(workplace: Workplace, monkeypatch: pytest.MonkeyPatch) -> None:
    """Curves, times and pictures of a repeated stage may differ: what reads its results stays."""
    before = workplace.run()["teacher"].manifest
    workplace.ran()
    monkeypatch.setenv("FAKE_BEHAVIOUR", json.dumps({"teacher": {"note": "another day"}}))
    after = workplace.run(force=frozenset({"teacher"}))["teacher"].manifest
    assert workplace.ran() == ["teacher"]
    assert after.files["summary.json"] != before.files["summary.json"]
    assert after.digest == before.digest


def test_a_declared_result_that_is_missing_is_a_mistake_of_the_stage(workplace: Workplace) -> None:
    declared = dataclasses.replace(workplace.registry["teacher"], results=("result.json", "weights.safetensors"))
    workplace.registry["teacher"] = declared
    with pytest.raises(PipelineFailed, match=r"none of the results that the stage declares: weights\.safetensors"):
        workplace.run(until="teacher")
    assert workplace.store.artifacts("teacher") == []


@pytest.mark.parametrize("name", ["manifest.json", "key.json", "recipe.yaml"])
def test_a_changed_number_in_what_stands_beside_the_results_is_damage(workplace: Workplace, name: str) -> None:
    folder = workplace.run()["teacher"].folder
    text = (folder / name).read_text()
    assert "4096" in text or name == "manifest.json"
    (folder / name).write_text(text.replace("4096", "4097").replace('"attempts": 1', '"attempts": 2'))
    (reason,) = workplace.plan()["teacher"].reasons
    assert reason.startswith(f"damaged: {name} ")


def test_what_stands_beside_the_results_makes_no_reader_crash_or_wait(workplace: Workplace) -> None:
    artifact = workplace.run(until="rg-dataset")["rg-dataset"]
    assert artifact.recipe["seed"] == 3
    (artifact.folder / "recipe.yaml").write_text("[" * 100_000)
    (artifact.folder / "key.json").unlink()
    os.mkfifo(artifact.folder / "key.json")
    assert (artifact.recipe, artifact.ingredients) == ({}, {})
    with pytest.raises(Damaged):
        artifact.verify()


def test_nothing_is_left_of_a_finished_stages_workspace(workplace: Workplace) -> None:
    workplace.run()
    assert list(workplace.store.runs.work.iterdir()) == []


def test_output_that_was_not_sealed_is_not_an_artifact(workplace: Workplace) -> None:
    key = workplace.run(until="rg-dataset")["rg-dataset"].manifest.key
    folder = workplace.store.folder("rg-dataset", key)
    workspace = Workspace(workplace.store.runs, "rg-dataset", key)
    workspace.root.mkdir(parents=True)
    folder.rename(workspace.out)
    (workspace.out / MANIFEST).unlink()
    workplace.ran()
    workplace.run(until="rg-dataset")
    assert workplace.ran() == ["rg-dataset"]


def test_a_death_between_sealing_and_publishing_loses_nothing(
    workplace: Workplace, monkeypatch: pytest.MonkeyPatch
) -> None:
    def die(self: Store, out: Path, stage: str, key: str) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Store, "add", die)
        with pytest.raises(Interrupted):
            workplace.run(until="rg-dataset")
    assert workplace.store.artifacts() == []
    workplace.ran()
    workplace.run(until="rg-dataset")
    assert workplace.ran() == []
    assert len(workplace.store.artifacts()) == 1


def test_a_forced_stage_replaces_its_artifact(workplace: Workplace) -> None:
    before = workplace.run()["teacher"].manifest
    after = workplace.run(force=frozenset({"teacher"}))["teacher"].manifest
    assert after.key == before.key
    assert after.made > before.made


def test_a_manifest_says_how_an_artifact_was_made(workplace: Workplace) -> None:
    artifact = workplace.run(workers=2)["teacher"]
    manifest = json.loads((artifact.folder / MANIFEST).read_text())
    assert (manifest["workers"], manifest["attempts"], manifest["recipe"]) == (2, 1, "small")
    assert "python" in manifest["versions"]


def test_no_flipped_bit_of_a_progress_stops_a_plan(workplace: Workplace) -> None:
    stage = "rg-dataset"
    workspace = Workspace(workplace.store.runs, stage, workplace.plan()[stage].key)
    workspace.begin("small", True, {"pipeline": "1a2b"}, "iowbc run small.yaml")
    workspace.state.metric, workspace.state.curve = "count", [(1.0, 2.5), (2.0, 3.5)]
    workspace.progress(3, 9, "counts")
    workspace.write()
    path = workspace.root / PROGRESS
    whole = path.read_bytes()
    planner = workplace.planner(force=frozenset({stage}))
    assert planner.plan()[0].expected == pytest.approx(2 * json.loads(whole)["seconds"])
    for place in range(len(whole)):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << place % 8
        path.write_bytes(flipped)
        assert not planner.plan()[0].cached


@pytest.fixture
def elsewhere() -> Iterator[Path]:
    """A folder on another file system than temporary files."""
    memory = Path("/dev/shm")
    if not memory.is_dir() or memory.stat().st_dev == Path(tempfile.gettempdir()).stat().st_dev:
        pytest.skip("no second file system here")
    with tempfile.TemporaryDirectory(dir=memory) as folder:
        yield Path(folder)


@pytest.mark.parametrize("part", ["store", "damaged", "work"])
def test_any_part_of_the_runs_may_be_on_another_file_system(workplace: Workplace, elsewhere: Path, part: str) -> None:
    workplace.store.runs.root.mkdir(exist_ok=True)
    (workplace.store.runs.root / part).symlink_to(elsewhere)
    folder = workplace.run()["teacher"].folder
    shorten(folder / "result.json")
    workplace.run()["teacher"].verify()
    workplace.run(force=frozenset({"teacher"}))["teacher"].verify()
    assert len(list(workplace.store.runs.damaged.iterdir())) == 1
    assert not list(workplace.store.runs.store.glob("*/.*"))
    workplace.ran()
    workplace.run()
    assert workplace.ran() == []


def test_a_death_between_two_renames_loses_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    old, new = tmp_path / "name", tmp_path / "fresh"
    for folder, text in ((old, "old"), (new, "new")):
        folder.mkdir()
        (folder / "file").write_text(text)

    def dies(source: Path, target: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(files, "move_folder", dies)
    with pytest.raises(KeyboardInterrupt):
        files.replace_folder(new, old)
    monkeypatch.undo()
    assert (tmp_path / ".name.old" / "file").read_text() == "old"
    files.restore_folder(tmp_path / ".name.old")
    assert (old / "file").read_text() == "old"
    files.replace_folder(new, old)
    assert (old / "file").read_text() == "new"
    assert not list(tmp_path.glob(".*"))


def rewritten(folder: Path, sealed: bool, **entries: Any) -> None:
    """The manifest with other entries, as a newer version may write it."""
    found = json.loads((folder / MANIFEST).read_text()) | entries
    seal = found.pop("seal")
    (folder / MANIFEST).write_text(json.dumps(found | {"seal": data_digest(found) if sealed else seal}))


def test_a_manifest_with_more_entries_is_read_and_one_of_another_form_is_called_newer(workplace: Workplace) -> None:
    made = workplace.run()
    rewritten(made["teacher"].folder, True, cost=3.5)
    assert workplace.plan()["teacher"].cached
    rewritten(made["teacher"].folder, False, cost=4.0)
    assert "differs from its seal" in workplace.plan()["teacher"].reasons[0]
    rewritten(made["eval"].folder, True, results={"result.json": "deciding"})
    with pytest.raises(Damaged, match="was written by a newer version of iowbc"):
        workplace.store.find("eval", made["eval"].manifest.key)


def test_a_damaged_record_is_made_again_from_the_artifacts(workplace: Workplace) -> None:
    workplace.run()
    workplace.run("seed=7")
    before = ever_used(workplace.store.runs, "small").keys()
    path = record_path(workplace.store.runs, "small")
    path.write_text(path.read_text()[:40])
    workplace.run()
    assert ever_used(workplace.store.runs, "small").keys() == before


def test_gc_spares_what_an_attempt_reads(workplace: Workplace) -> None:
    workplace.run()
    fit = workplace.store.artifacts("rg-fit")[0]
    attempt = workplace.folder / "runs" / "work" / ("f" * 64)
    (attempt / "out").mkdir(parents=True)
    (attempt / INGREDIENTS).write_text(json.dumps({"inputs": {"rg-fit": fit.manifest.digest}}))
    with key_lock(workplace.store.runs, attempt.name, on_wait=lambda _: None, interrupted=lambda: False):
        removed = workplace.command("gc", "--recipe", "small").output
    assert "store/teacher" in removed
    assert fit.folder.is_dir()
    assert "store/rg-fit" not in removed
