"""A stage of a recipe that is being trained, or was interrupted, for who wants to see the newest policy."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iowbc.pipeline.console.wording import ago
from iowbc.pipeline.store.artifact import INGREDIENTS, RECIPE
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.store.runs import read_json, read_yaml
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import unfinished
from iowbc.stages.registry import STAGES

PLAYED = "teacher"
"""The stage whose checkpoint can be played."""
CHECKPOINT = Path("scratch", "training.checkpoint")


@dataclass(frozen=True)
class InTraining:
    """A training that is not finished."""

    stage: str
    key: str
    text: str
    """What to tell the user of it."""
    checkpoint: Path
    ingredients: Mapping[str, Any]
    """What its key was computed from."""
    recipe: Mapping[str, Any] | None
    """The resolved recipe; None where the checkpoint cannot be played."""


def in_training(store: Store, word: str, stage: str | None) -> InTraining | None:
    """The newest unfinished training that `RECIPE/STAGE`, or a recipe and `--stage`, names, if there is one."""
    name, slash, last = word.rpartition("/")
    name, wanted = (name, last) if slash else (word, stage)
    if wanted not in STAGES or not STAGES[wanted].presentation.trained_by:
        return None
    for folder, record in unfinished(store.runs):
        if (record.get("stage"), record.get("recipe")) == (wanted, Path(name).stem):
            return _described(store, folder, record)
    return None


def _described(store: Store, folder: Path, record: Mapping[str, Any]) -> InTraining:
    checkpoint, ingredients = folder / CHECKPOINT, read_json(folder / INGREDIENTS)
    recipe = read_yaml(folder / RECIPE)
    total = float(record.get("total", 0.0))
    state = "is being trained" if holder(store.runs, folder.name) else "was interrupted"
    share = f", {100 * float(record.get('done', 0.0)) / total:.0f} % done" if total else ""
    known = isinstance(recipe, dict) and isinstance(ingredients, dict)
    playable = record["stage"] == PLAYED and checkpoint.is_file() and known
    then = f"; this is its checkpoint of {ago(checkpoint.stat().st_mtime)}" if playable else ""
    return InTraining(
        stage=str(record["stage"]),
        key=folder.name,
        text=f"{record['stage']} of {record['recipe']} {state}{share}{then}",
        checkpoint=checkpoint,
        ingredients=ingredients if isinstance(ingredients, dict) else {},
        recipe=recipe if playable else None,
    )
