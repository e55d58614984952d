"""Records of artifacts that each recipe used last (for `status`, `show`) and ever (kept by `gc`), and links."""

import os
import shlex
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from iowbc.errors import Damaged, UsageError
from iowbc.files import write_whole
from iowbc.pipeline.console.wording import KEY_LENGTH
from iowbc.pipeline.store.artifact import MANIFEST, RECIPE, Artifact
from iowbc.pipeline.store.locks import lock_path, named_lock
from iowbc.pipeline.store.runs import Runs, read_json, read_record
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import LoadedRecipe
from iowbc.recipe.recipe import PIPELINE


class Use(BaseModel):
    """An artifact that a recipe used."""

    key: str
    time: float
    """[s since 1970]."""


class LastUsed(BaseModel):
    """The record of a recipe."""

    file: str = ""
    overrides: list[str] = []
    recipe: dict[str, Any] = {}
    """Resolved; empty where its name stands for nothing of its own."""
    stages: dict[str, Use] = {}
    ever: dict[str, float] = {}
    """When it, with any overrides, last used an artifact, by its key [s since 1970]."""


def remember(runs: Runs, loaded: LoadedRecipe, artifact: Artifact) -> None:
    """Record that a recipe's stage uses this artifact.

    A recipe's name stands for its artifacts without overrides. A run with overrides only adds to `ever`, unless nothing
    else goes by that name; its stages are never mixed with those of other overrides.
    """
    stage, key, name = artifact.manifest.stage, artifact.manifest.key, loaded.recipe.name
    with named_lock(lock_path(runs, f"recipe-{name}")):
        record = read_record(LastUsed, record_path(runs, name))
        if record is None:  # where it is damaged, what it made counts as used now
            made = _keys(runs.store, name) if record_path(runs, name).exists() else []
            record = LastUsed(ever=dict.fromkeys(made, time.time()))
        if not loaded.overrides or record.overrides or not (record.recipe or _keys(runs.published, name)):
            if record.overrides != list(loaded.overrides):
                for other in record.stages:
                    (runs.root / name / other).unlink(missing_ok=True)
                record.stages = {}
            record.file, record.overrides = str(loaded.file), list(loaded.overrides)
            record.recipe = loaded.recipe.model_dump(mode="json")
            record.stages[stage] = Use(key=key, time=time.time())
            for other in _outdated(runs, record, artifact):
                del record.stages[other]
                (runs.root / name / other).unlink(missing_ok=True)
            _link(runs, name, stage, artifact.folder)
        elif stage not in record.stages or record.stages[stage].key != key:
            _link(runs, name, _with_key(stage, artifact.folder), artifact.folder)
        record.ever[key] = time.time()
        write_whole(record_path(runs, name), record.model_dump_json(indent=1))


def _outdated(runs: Runs, record: LastUsed, artifact: Artifact) -> list[str]:
    """Stages of a record that were made from another artifact of this one's stage, or from such a stage."""
    store, made, found = Store(runs), artifact.manifest, list[str]()
    for stage in PIPELINE:
        if stage in record.stages and (used := store.find_any(stage, record.stages[stage].key)) is not None:
            inputs = used.ingredients.get("inputs", {})
            if inputs.get(made.stage, made.digest) != made.digest or inputs.keys() & {*found}:
                found.append(stage)
    return found


def ever_used(runs: Runs, recipe: str) -> dict[str, float]:
    """When a recipe, with any overrides, last used an artifact, by its key [s since 1970]."""
    record = recall(runs, recipe)
    return {use.key: use.time for use in record.stages.values()} | record.ever


def recall(runs: Runs, recipe: str) -> LastUsed:
    """The record of a recipe by name; empty where it never finished a stage. Raises `UsageError` where damaged."""
    record = read_record(LastUsed, record_path(runs, recipe))
    if record is None and record_path(runs, recipe).exists():
        raise UsageError(f"{record_path(runs, recipe)} is damaged; run the recipe again to remake it")
    return record or LastUsed()


def record_path(runs: Runs, recipe: str) -> Path:
    return runs.recipes / f"{recipe}.json"


def require_whole(runs: Runs, artifacts: Iterable[Artifact]) -> None:
    """Verifies the files of artifacts, each once. Raises `UsageError` for a damaged one, with the command that makes it
    again from the recipe as it was requested, or from the stored recipe where that file has changed."""
    for artifact in {artifact.folder: artifact for artifact in artifacts}.values():
        try:
            artifact.verify()
        except Damaged as error:
            text = f"{artifact.folder} is damaged: {error}; to make it anew: {_again(runs, artifact)}"
            raise UsageError(text) from None


def require_results(runs: Runs, artifact: Artifact) -> None:
    """Raises `UsageError` for a published artifact that lacks results, with the command that makes it again."""
    if not artifact.whole:
        made = artifact.manifest
        lacking = ", ".join(name for name in made.results if name in made.omitted)
        again = _again(runs, artifact, "--until", made.stage, "--force", made.stage)
        text = f"{made.stage} of {made.recipe} came with the repository without {lacking}"
        raise UsageError(f"{text}; to make it anew: {again}")


def _again(runs: Runs, artifact: Artifact, *options: str) -> str:
    made, words = artifact.manifest, ["iowbc", "run", str(artifact.folder / RECIPE)]
    record = read_record(LastUsed, record_path(runs, made.recipe))
    if record is not None and made.stage in record.stages and record.stages[made.stage].key == made.key:
        words[-1] = record.file or words[-1]
        words += [word for override in record.overrides for word in ("--set", override)]
    return shlex.join([*words, *options, *runs.option])


def named_folder(runs: Runs, recipe: str, stage: str, artifact: Path) -> Path:
    """The link below `runs/<recipe>` that leads to an artifact's folder, else that folder."""
    links = (runs.root / recipe / name for name in (stage, _with_key(stage, artifact)))
    return next((one for one in links if one.is_symlink() and one.resolve() == artifact.resolve()), artifact)


def remove_dangling(runs: Runs) -> None:
    for folder in runs.root.iterdir() if runs.root.is_dir() else ():
        if folder.is_dir() and folder not in runs.parts and _only_links(folder):
            for path in folder.iterdir():
                if not path.exists():
                    path.unlink()
            if not any(folder.iterdir()):
                folder.rmdir()


def _link(runs: Runs, recipe: str, name: str, artifact: Path) -> None:
    """Let `runs/<recipe>/<name>` lead to an artifact's folder; a recipe named like a part of `runs` has no links."""
    folder = runs.root / recipe
    if folder in runs.parts or (os.path.lexists(folder) and not _only_links(folder)):
        return
    folder.mkdir(exist_ok=True)
    fresh = folder / f".{name}.{os.getpid()}"
    fresh.unlink(missing_ok=True)
    fresh.symlink_to(os.path.relpath(artifact, folder))
    os.replace(fresh, folder / name)


def _with_key(stage: str, artifact: Path) -> str:
    """Name of the link of a run with overrides; without, it is the stage's."""
    return f"{stage}-{artifact.name[:KEY_LENGTH]}"


def _only_links(folder: Path) -> bool:
    return folder.is_dir() and all(path.is_symlink() for path in folder.iterdir())


def _keys(folder: Path, recipe: str) -> list[str]:
    """Keys of the artifacts in `store` or `published` that a recipe made."""
    return [file.parent.name for file in folder.glob(f"*/*/{MANIFEST}") if read_json(file).get("recipe") == recipe]
