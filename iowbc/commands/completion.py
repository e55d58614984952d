"""Completions that a shell offers on Tab: recipes, stages, artifacts by name or key, and dotted paths of a recipe."""

import os
from collections.abc import Iterable
from pathlib import Path

from iowbc.pipeline.nested import flattened
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import known_files
from iowbc.recipe.recipe import PIPELINE, Recipe


def recipes(incomplete: str) -> list[str]:
    """Recipes that can be run by name; a path is the shell's own business."""
    return _beginning(incomplete, (path.stem for path in known_files()))


def ran(incomplete: str) -> list[str]:
    """Recipes that have run, or are published."""
    from iowbc.commands.lookup import known_names

    return _beginning(incomplete, known_names(_store()))


def artifacts(incomplete: str) -> list[str]:
    """Recipes that have run or are published, `RECIPE/STAGE`, and, once something is typed, keys."""
    from iowbc.commands.lookup import known_names

    store = _store()
    known = known_names(store)
    stages = [f"{name}/{stage}" for name, found in known.items() for stage in found]
    keys = [found.manifest.key for found in store.artifacts()] if incomplete else []
    return _beginning(incomplete, [*known, *stages, *keys])


def stages(incomplete: str) -> list[str]:
    return _beginning(incomplete, PIPELINE)


def paths(incomplete: str) -> list[str]:
    """Dotted paths of a recipe's values, with the sign that a value follows."""
    return _beginning(incomplete, (f"{path}=" for path in flattened(Recipe(name="any").model_dump(mode="json"))))


def _store() -> Store:
    return Store(Runs(Path(os.environ.get("IOWBC_RUNS") or "runs")))


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return sorted({name for name in names if name.startswith(incomplete)})
