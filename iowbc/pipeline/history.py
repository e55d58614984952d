"""What each recipe used last: the artifacts that a plan compares with and `status` shows."""

import json
import time
from typing import Any

from iowbc.pipeline.layout import Runs, read_json, write_atomically
from iowbc.pipeline.store import Artifact, Damaged, Store
from iowbc.recipe.loading import LoadedRecipe


def remember(runs: Runs, loaded: LoadedRecipe, stage: str, key: str) -> None:
    """Record that a recipe's stage has this artifact now."""
    path = runs.recipes / f"{loaded.recipe.name}.json"
    record = recall(runs, loaded.recipe.name)
    record["file"] = str(loaded.file)
    record["overrides"] = list(loaded.overrides)
    record["recipe"] = loaded.recipe.model_dump(mode="json")
    record.setdefault("stages", {})[stage] = {"key": key, "time": time.time()}
    write_atomically(path, json.dumps(record, indent=1))


def recall(runs: Runs, recipe: str) -> dict[str, Any]:
    """The record of a recipe by name; empty where it never finished a stage."""
    record = read_json(runs.recipes / f"{recipe}.json")
    return record if isinstance(record, dict) else {}


def previous(store: Store, recipe: str, stage: str) -> Artifact | None:
    """The artifact that this recipe used last for a stage; else the newest of that stage, whoever made it."""
    key = recall(store.runs, recipe).get("stages", {}).get(stage, {}).get("key")
    if key:
        try:
            artifact = store.find(stage, key)
        except Damaged:
            artifact = None
        if artifact is not None:
            return artifact
    artifacts = store.artifacts(stage)
    own = [artifact for artifact in artifacts if artifact.manifest.recipe == recipe]
    return (own or artifacts or [None])[-1]  # type: ignore[list-item]
