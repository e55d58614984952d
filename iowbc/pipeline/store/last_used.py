"""Artifacts that each recipe used last, for `status` and `show`, and ever, which `gc` spares."""

import json
import shlex
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from iowbc.errors import Damaged, UsageError
from iowbc.files import write_whole
from iowbc.pipeline.store.artifact import RECIPE, Artifact
from iowbc.pipeline.store.links import link
from iowbc.pipeline.store.runs import Runs, read_json
from iowbc.recipe.reading.loading import LoadedRecipe


def remember(runs: Runs, loaded: LoadedRecipe, artifact: Artifact) -> None:
    """Record that a recipe's stage uses this artifact.

    What a recipe has without overrides is what its name stands for: a run with some only adds to what was ever used.
    """
    stage, key = artifact.manifest.stage, artifact.manifest.key
    path = record_path(runs, loaded.recipe.name)
    record = _record(path) or {"stages": {}}
    if not loaded.overrides or record.get("overrides", True):
        record["file"] = str(loaded.file)
        record["overrides"] = list(loaded.overrides)
        record["recipe"] = loaded.recipe.model_dump(mode="json")
        record["stages"][stage] = {"key": key, "time": time.time()}
        link(runs, loaded.recipe.name, stage, artifact.folder)
    elif record["stages"].get(stage, {}).get("key") != key:
        link(runs, loaded.recipe.name, stage, artifact.folder, with_overrides=True)
    record.setdefault("ever", {})[key] = time.time()
    write_whole(path, json.dumps(record, indent=1))


def ever_used(runs: Runs, recipe: str) -> dict[str, float]:
    """When a recipe, with any overrides, last used an artifact, by its key [s since 1970]."""
    record = recall(runs, recipe)
    last = {str(use["key"]): float(use["time"]) for use in record.get("stages", {}).values()}
    return last | {str(key): float(moment) for key, moment in record.get("ever", {}).items()}


def recall(runs: Runs, recipe: str) -> dict[str, Any]:
    """The record of a recipe by name; empty where it never finished a stage. Raises `UsageError` where damaged."""
    path = record_path(runs, recipe)
    record = _record(path)
    if record is None and path.exists():
        raise UsageError(f"{path} is damaged; run the recipe again to remake it")
    return record or {}


def record_path(runs: Runs, recipe: str) -> Path:
    """Path of the record of a recipe."""
    return runs.recipes / f"{recipe}.json"


def remaking(runs: Runs, artifact: Artifact) -> str:
    """The command that makes an artifact anew: its recipe as it was asked for, or, where that changed, as kept."""
    made = artifact.manifest
    record = _record(record_path(runs, made.recipe)) or {}
    words = ["iowbc", "run", str(artifact.folder / RECIPE)]
    if record.get("stages", {}).get(made.stage, {}).get("key") == made.key:
        words[-1] = str(record.get("file", words[-1]))
        for override in record.get("overrides", []):
            words += ["--set", str(override)]
    if runs.root != Path("runs"):
        words += ["--runs", str(runs.root)]
    return shlex.join(words)


def require_whole(runs: Runs, artifacts: Iterable[Artifact]) -> None:
    """Raises `UsageError` with the command that makes an artifact anew, where a file of it is not what was written.

    One that is named repeatedly is read once.
    """
    for artifact in {artifact.folder: artifact for artifact in artifacts}.values():
        try:
            artifact.verify()
        except Damaged as error:
            raise UsageError(
                f"{artifact.folder} is damaged: {error}; to make it anew: {remaking(runs, artifact)}"
            ) from None


def _record(path: Path) -> dict[str, Any] | None:
    """A record that is whole, or None."""
    record = read_json(path)
    if not isinstance(record, dict) or not isinstance(record.get("recipe"), dict):
        return None
    stages, ever = record.get("stages"), record.get("ever", {})
    if not isinstance(record.get("overrides", []), list):
        return None
    if not isinstance(ever, dict) or not all(isinstance(moment, (int, float)) for moment in ever.values()):
        return None
    if not isinstance(stages, dict) or not all(
        isinstance(use, dict) and isinstance(use.get("key"), str) and isinstance(use.get("time"), (int, float))
        for use in stages.values()
    ):
        return None
    return record
