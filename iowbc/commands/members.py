"""The recipes that a sweep, a study or a comparison consists of, kept so that other commands know them by its name."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

from iowbc.commands.named import finished_recipes
from iowbc.files import write_whole
from iowbc.pipeline.store.runs import Runs, read_json
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.finding import recipe_file
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.reading.sweep import Sweep

SWEEP_RECORD = "sweep.json"
"""File of a sweep with its points."""
COMPARISON_RECORD = "runs.json"
"""File of a comparison with its runs."""
FILM = "side_by_side.mp4"
"""Its film of one trial."""


def record_sweep(found: Sweep, folder: Path) -> None:
    """Keep a sweep's points and their settings in its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    points = {point.name: dict(point.settings) for point in found.points}
    write_whole(folder / SWEEP_RECORD, json.dumps({"axes": found.axes, "points": points}, indent=1))


def points_of(store: Store, words: Sequence[str]) -> list[str]:
    """Names of recipes, with the finished ones of a sweep, of a recipe of recipes, or of a comparison in place of its
    name."""
    recipes = finished_recipes(store)
    found: list[str] = []
    for word in words:
        record = read_json(store.runs.sweeps / word / SWEEP_RECORD) if word not in recipes else None
        points = record.get("points") if isinstance(record, dict) else None
        names = list(points) if isinstance(points, dict) else []
        if not names and word not in recipes:
            names = [*members_of(word)] or recorded_comparison(store.runs.compared / word)
        found += [name for name in names if name in recipes] or [word]
    return found


def members_of(word: str) -> tuple[str, ...]:
    """Names of the recipes that a recipe of recipes names; of anything else none. Raises `RecipeError`."""
    study = load_study(word) if os.path.isfile(recipe_file(word)) else None
    return () if study is None else tuple(variant.recipe.name for variant in study.variants)


def record_comparison(words: Sequence[str], folder: Path) -> None:
    """Keep what the runs are called, in the folder of their comparison."""
    write_whole(folder / COMPARISON_RECORD, json.dumps({"runs": list(words)}, indent=1))


def recorded_comparison(folder: Path) -> list[str]:
    """The runs that a folder compares; none where it is no comparison."""
    found = read_json(folder / COMPARISON_RECORD)
    words = found.get("runs") if isinstance(found, dict) else None
    return [word for word in words if isinstance(word, str)] if isinstance(words, list) else []


def film_of(runs: Runs, words: Sequence[str]) -> Path | None:
    """The film of a comparison of the same runs, if one was made."""
    films = [runs.compared / FILM, *sorted(runs.compared.glob(f"*/{FILM}"))]
    return next(
        (path for path in films if path.is_file() and sorted(recorded_comparison(path.parent)) == sorted(words)), None
    )
