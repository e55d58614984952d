"""What each recipe used last: the artifacts that `status` and `show` tell of and `gc` keeps."""

import json
import shlex
import time
from pathlib import Path
from typing import Any

from iowbc.errors import UsageError
from iowbc.files import write_whole
from iowbc.pipeline.store.artifact import RECIPE, Artifact
from iowbc.pipeline.store.runs import Runs, read_json
from iowbc.recipe.reading.loading import LoadedRecipe


def remember(runs: Runs, loaded: LoadedRecipe, stage: str, key: str) -> None:
    """Record that a recipe's stage has this artifact now."""
    path = record_path(runs, loaded.recipe.name)
    record = _record(path) or {}
    record["file"] = str(loaded.file)
    record["overrides"] = list(loaded.overrides)
    record["recipe"] = loaded.recipe.model_dump(mode="json")
    record.setdefault("stages", {})[stage] = {"key": key, "time": time.time()}
    write_whole(path, json.dumps(record, indent=1))


def recall(runs: Runs, recipe: str) -> dict[str, Any]:
    """The record of a recipe by name; empty where it never finished a stage. Raises `UsageError` where damaged."""
    path = record_path(runs, recipe)
    record = _record(path)
    if record is None and path.exists():
        raise UsageError(f"{path} is damaged; run the recipe again to remake it")
    return record or {}


def record_path(runs: Runs, recipe: str) -> Path:
    """Where the record of a recipe stands."""
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


def _record(path: Path) -> dict[str, Any] | None:
    """A record that is whole, or None."""
    record = read_json(path)
    if not isinstance(record, dict) or not isinstance(record.get("recipe"), dict):
        return None
    stages = record.get("stages")
    if not isinstance(stages, dict) or not all(
        isinstance(use, dict) and {"key", "time"} <= use.keys() for use in stages.values()
    ):
        return None
    return record
