"""What a sweep or a recipe of recipes consists of, so that other commands know them by their names."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

from iowbc.commands.compared import recorded
from iowbc.commands.named import finished_recipes
from iowbc.files import write_whole
from iowbc.pipeline.store.runs import read_json
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.finding import recipe_file
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.reading.sweep import Sweep

RECORD = "sweep.json"
"""File of a sweep with its points."""


def record(found: Sweep, folder: Path) -> None:
    """Keep a sweep's points and their settings in its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    points = {point.name: dict(point.settings) for point in found.points}
    write_whole(folder / RECORD, json.dumps({"axes": found.axes, "points": points}, indent=1))


def points_of(store: Store, words: Sequence[str]) -> list[str]:
    """Names of recipes, with the finished ones of a sweep, of a recipe of recipes, or of a comparison in place of its
    name."""
    recipes = finished_recipes(store)
    found: list[str] = []
    for word in words:
        record = read_json(store.runs.sweeps / word / RECORD) if word not in recipes else None
        points = record.get("points") if isinstance(record, dict) else None
        names = list(points) if isinstance(points, dict) else []
        if not names and word not in recipes:
            names = [*members_of(word)] or recorded(store.runs.compared / word)
        found += [name for name in names if name in recipes] or [word]
    return found


def members_of(word: str) -> tuple[str, ...]:
    """Names of the recipes that a recipe of recipes names; of anything else none. Raises `RecipeError`."""
    study = load_study(word) if os.path.isfile(recipe_file(word)) else None
    return () if study is None else tuple(variant.recipe.name for variant in study.variants)
