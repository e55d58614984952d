"""What a user calls an artifact or a recipe, and what is meant."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from iowbc.deploy.exported_folder import SHORTEST_PREFIX
from iowbc.errors import UsageError, nearest
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.last_used import recall
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.finding import SUFFIXES
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import PIPELINE


@dataclass(frozen=True)
class Named:
    """What a word of the command line means."""

    word: str
    artifacts: Mapping[str, Artifact]
    """By stage: all that a recipe used last, or the one artifact that was named."""
    recipe: Mapping[str, Any] | None = None
    """The resolved recipe, where the word names a recipe."""
    shipped: Mapping[str, Artifact] = field(default_factory=dict)
    """By stage: what came with the repository under the recipe's name, where it has used nothing else yet."""

    @property
    def usable(self) -> dict[str, Artifact]:
        """By stage: all that there is to play or to take along."""
        return {**self.shipped, **self.artifacts}


def named(store: Store, word: str) -> Named:
    """The meaning of a recipe's name or file, `RECIPE/STAGE`, or the first characters of a key. Raises `UsageError`."""
    recipes = finished_recipes(store)
    if Path(word).suffix in SUFFIXES:
        return _recipe(store, word, _name_in(Path(word)), recipes)
    if word in recipes:
        return _recipe(store, word, word, recipes)
    name, slash, stage = word.rpartition("/")
    name = _name_in(Path(name)) if Path(name).suffix in SUFFIXES else name
    if slash and name in recipes:
        found = _recipe(store, word, name, recipes)
        if stage not in found.usable:
            stages = ", ".join(found.usable) or "none"
            raise UsageError(f"{word}: recipe {name} has no finished stage '{stage}'; finished: {stages}")
        return Named(word, {stage: found.usable[stage]})
    artifact = _by_key(store, word)
    return Named(word, {artifact.manifest.stage: artifact})


def open_artifact(word: str, runs: Path | str = "runs") -> Artifact:
    """From Python: the artifact that `RECIPE/STAGE` or the first characters of a key name. Raises `UsageError`."""
    found = named(Store(Runs(Path(runs))), word)
    if found.recipe is not None:
        stages = ", ".join(f"{word}/{stage}" for stage in found.usable)
        raise UsageError(f"'{word}' is a recipe; name one of its artifacts: {stages or 'none is stored'}")
    (artifact,) = found.artifacts.values()
    return artifact


def known_recipes(store: Store) -> list[str]:
    """Names of the recipes that have finished a stage, alphabetically."""
    return sorted(path.stem for path in store.runs.recipes.glob("*.json"))


def finished_recipes(store: Store) -> list[str]:
    """Names of the recipes that have finished a stage here, or came with the repository, alphabetically."""
    return sorted({*known_recipes(store), *_published(store)})


def nameable(store: Store) -> dict[str, tuple[str, ...]]:
    """By the name of each recipe that `named` knows, alphabetically: stages that can be named with it."""
    names = finished_recipes(store)
    return {name: tuple(_recipe(store, name, name, names).usable) for name in names}


def last_used(store: Store, recipe: str) -> dict[str, Artifact]:
    """By stage: the artifacts that a recipe used last, as far as they are still stored."""
    found = {}
    for stage, use in recall(store.runs, recipe).get("stages", {}).items():
        artifact = store.find_any(stage, use["key"])
        if artifact is not None:
            found[stage] = artifact
    return found


def _recipe(store: Store, word: str, name: str, recipes: list[str]) -> Named:
    if name not in recipes:
        listing = ", ".join(recipes) or "none"
        raise UsageError(f"recipe {word} has no finished stage in {store.runs.root}; those that have: {listing}")
    shipped = _published(store).get(name, {})
    if name not in known_recipes(store):
        return Named(word, shipped, list(shipped.values())[-1].recipe)
    used = last_used(store, name)
    others = {stage: artifact for stage, artifact in shipped.items() if stage not in used}
    return Named(word, used, recall(store.runs, name)["recipe"], others)


def _name_in(file: Path) -> str:
    """The name that a recipe file gives, else that of the file."""
    return load_recipe(file).recipe.name if os.path.isfile(file) else file.stem.lower()


def _published(store: Store) -> dict[str, dict[str, Artifact]]:
    """By the recipe that made them, and by stage: the artifacts that came with the repository."""
    found: dict[str, dict[str, Artifact]] = {}
    for stage in PIPELINE:
        for artifact in store.artifacts(stage):
            if artifact.published:
                found.setdefault(artifact.manifest.recipe, {})[stage] = artifact
    return found


def _by_key(store: Store, prefix: str) -> Artifact:
    found = [artifact for artifact in store.artifacts() if artifact.manifest.key.startswith(prefix)]
    if len(prefix) >= SHORTEST_PREFIX and len(found) == 1:
        return found[0]
    if len(prefix) >= SHORTEST_PREFIX and found:
        keys = ", ".join(f"{artifact.manifest.stage} {artifact.manifest.key[:12]}" for artifact in found)
        raise UsageError(f"'{prefix}' is the beginning of several keys: {keys}")
    recipes = [*nameable(store)]
    raise UsageError(
        f"'{prefix}' is neither a recipe that has run or is published in {store.runs.root} "
        f"({', '.join(recipes) or 'none is'}), "
        f"nor RECIPE/STAGE, nor the first {SHORTEST_PREFIX} or more characters of a key; `iowbc ls` lists them"
        f"{nearest(prefix, recipes)}"
    )
