"""Lookup of artifacts, recipes and trainings by name, and the records of sweeps and comparisons."""

import contextlib
import json
import os
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from iowbc.deploy.exported_folder import SHORTEST_PREFIX
from iowbc.errors import UsageError, nearest
from iowbc.files import write_whole
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.last_used import LastUsed, recall
from iowbc.pipeline.store.runs import Runs, read_json
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import SUFFIXES, load_recipe, recipe_file
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.recipe import PIPELINE, Recipe
from iowbc.recipe.section import deciding
from iowbc.recipe.sweep import Sweep
from iowbc.report.runs import Run
from iowbc.stages.registry import STAGES

SWEEP_RECORD, COMPARISON_RECORD = "sweep.json", "runs.json"
"""Files of a sweep with its points, and of a comparison with its runs."""
SWEEP_TABLE, SWEEP_POINTS = "table.md", "points.csv"
"""Files of a sweep with its results."""
FILM = "side_by_side.mp4"
"""Film of one trial of a comparison."""
COMPARED = ("tables", "figures")
"""Folders of a comparison."""


def named(store: Store, word: str) -> Run:
    """The meaning of a recipe's name or file, `RECIPE/STAGE`, or the first characters of a key. Raises `UsageError`."""
    recipes, published = finished_recipes(store), _published(store)
    if word not in recipes:
        require_no_study(word)
    if word in recipes or Path(word).suffix in SUFFIXES:
        return _recipe(store, word, name_in(word), published)
    head, slash, stage = word.rpartition("/")
    if slash and (name := name_in(head)) in recipes:
        found = _recipe(store, word, name, published).usable
        if stage not in found:
            stages = ", ".join(found) or "none"
            raise UsageError(f"{word}: recipe {name} has no finished stage '{stage}'; finished: {stages}")
        return Run(word, {stage: found[stage]})
    artifact = _by_key(store, word)
    return Run(word, {artifact.manifest.stage: artifact})


def open_artifact(word: str, runs: Path | str = "runs") -> Artifact:
    """From Python: the artifact that `RECIPE/STAGE` or the first characters of a key name. Raises `UsageError`."""
    found = named(Store(Runs(Path(runs))), word)
    if found.recipe:
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


def known_names(store: Store) -> dict[str, tuple[str, ...]]:
    """Recipes that `named` accepts, alphabetically, with the stages of each that can be named."""
    published, found = _published(store), dict[str, tuple[str, ...]]()
    for name in finished_recipes(store):
        with contextlib.suppress(UsageError):  # of a damaged record
            found[name] = tuple(_recipe(store, name, name, published).usable)
    return found


def last_used(store: Store, recipe: str) -> dict[str, Artifact]:
    """By stage: the artifacts that a recipe used last, as far as they are still stored."""
    used = recall(store.runs, recipe).stages.items()
    return {stage: found for stage, use in used if (found := store.find_any(stage, use.key)) is not None}


def _recipe(store: Store, word: str, name: str, published: Mapping[str, Mapping[str, Artifact]]) -> Run:
    record = recall(store.runs, name) if name in known_recipes(store) else LastUsed()
    shipped = published.get(name, {})
    if not record.stages and not shipped:
        listing = ", ".join(sorted({*known_recipes(store), *published})) or "none"
        raise UsageError(f"recipe {word} has no finished stage in {store.runs.root}; those that have: {listing}")
    if not record.stages:
        own = [artifact for artifact in shipped.values() if artifact.manifest.recipe == name]
        return Run(word, shipped, own[-1].recipe)
    used = last_used(store, name)
    if shipped.keys() - used.keys():
        with contextlib.suppress(ValidationError):  # a record of another version
            recipe = Recipe.model_validate(record.recipe)
            values = deciding(recipe)
            for stage, artifact in shipped.items():
                key_values = STAGES[stage].key_values(recipe, values)
                if stage not in used and _continues(artifact, key_values, used):
                    used[stage] = artifact
    others = {stage: artifact for stage, artifact in shipped.items() if stage not in used}
    return Run(word, used, record.recipe, others)


def _continues(artifact: Artifact, key_values: Mapping[str, Any], used: Mapping[str, Artifact]) -> bool:
    """True for a published artifact that a recipe with these values would use after those that it used last."""
    known = artifact.ingredients
    read = known.get("inputs", {})
    inputs = {source: used[source].manifest.digest for source in read if source in used}
    version = STAGES[artifact.manifest.stage].version
    return read.items() >= inputs.items() and (known.get("version"), known.get("recipe")) == (version, key_values)


def name_in(word: str) -> str:
    """The name that a recipe file gives, else that of the file; any other word as it is."""
    if Path(word).suffix not in SUFFIXES:
        return word
    return load_recipe(word).recipe.name if os.path.isfile(word) else Path(word).stem.lower()


def _published(store: Store) -> dict[str, dict[str, Artifact]]:
    """By recipe and stage: the published artifacts, and those, also of other recipes, that they were made from."""
    published = [one for stage in PIPELINE for one in store.published(stage)]
    newest = {one.manifest.key: store.find_any(one.manifest.stage, one.manifest.key) or one for one in published}
    found: dict[str, dict[str, Artifact]] = {}
    for artifact in published:
        found.setdefault(artifact.manifest.recipe, {})[artifact.manifest.stage] = newest[artifact.manifest.key]
    contents = {(one.manifest.stage, one.manifest.digest): newest[one.manifest.key] for one in published}
    for own in found.values():
        for stage in reversed(PIPELINE):
            read = own[stage].ingredients.get("inputs", {}) if stage in own else {}
            for source in read.items() & contents.keys():
                own.setdefault(source[0], contents[source])
    return {recipe: {stage: own[stage] for stage in PIPELINE if stage in own} for recipe, own in found.items()}


def _by_key(store: Store, prefix: str) -> Artifact:
    long_enough = len(prefix) >= SHORTEST_PREFIX
    found = [one for one in store.artifacts() if long_enough and one.manifest.key.startswith(prefix)]
    if len(found) == 1:
        return found[0]
    if found:
        keys = ", ".join(f"{artifact.manifest.stage} {artifact.manifest.key[:12]}" for artifact in found)
        raise UsageError(f"'{prefix}' is the beginning of several keys: {keys}")
    recipes = [*known_names(store)]
    raise UsageError(
        f"'{prefix}' is neither a recipe that has run or is published in {store.runs.root} "
        f"({', '.join(recipes) or 'none is'}), "
        f"nor RECIPE/STAGE, nor the first {SHORTEST_PREFIX} or more characters of a key; `iowbc ls` lists them"
        f"{nearest(prefix, recipes)}"
    )


def record_sweep(found: Sweep, folder: Path) -> None:
    """Keep a sweep's points in its folder, where other commands find them; remove the results of other points."""
    folder.mkdir(parents=True, exist_ok=True)
    points = {point.name: dict(point.settings) for point in found.points}
    if read_json(folder / SWEEP_RECORD).get("points") != points:
        for name in (SWEEP_TABLE, SWEEP_POINTS):
            (folder / name).unlink(missing_ok=True)
    write_whole(folder / SWEEP_RECORD, json.dumps({"axes": found.axes, "points": points}, indent=1))


def start_comparison(words: Sequence[str], folder: Path) -> None:
    """Remove what an earlier comparison left in a folder, but a film of the same runs, and record the new runs."""
    record = folder / COMPARISON_RECORD
    if record.is_file():
        for part in COMPARED:
            shutil.rmtree(folder / part, ignore_errors=True)
    if sorted(_recorded(record, "runs")) != sorted(words):
        (folder / FILM).unlink(missing_ok=True)
    write_whole(record, json.dumps({"runs": list(words)}, indent=1))


def points_of(store: Store, words: Sequence[str]) -> list[str]:
    """Names of recipes, each once; the name of a sweep, study or comparison is replaced by its finished recipes.
    Raises `UsageError` if none of them has finished."""
    recipes = finished_recipes(store)
    found: list[str] = []
    for word in words:
        names: Sequence[str] = ()
        if word not in recipes:
            swept = _recorded(store.runs.sweeps / word / SWEEP_RECORD, "points")
            names = swept or members_of(word) or _recorded(store.runs.compared / word / COMPARISON_RECORD, "runs")
        finished = [name for name in names if name in recipes]
        if names and not finished:
            raise UsageError(f"{word}: none of {', '.join(names)} has finished a stage; `iowbc run` makes them")
        found += finished or [word]
    return list(dict.fromkeys(found))


def _recorded(file: Path, key: str) -> list[str]:
    """Names in the record of a sweep or a comparison; none where the file is no such record."""
    names = read_json(file).get(key)
    return [name for name in names if isinstance(name, str)] if isinstance(names, (dict, list)) else []


def members_of(word: str) -> tuple[str, ...]:
    """Names of the recipes that a study names; of anything else none. Raises `RecipeError`."""
    return tuple(one.recipe.name for one in load_study(word)) if os.path.isfile(recipe_file(word)) else ()


def require_no_study(word: str) -> None:
    """Raises `UsageError` for a study, which names several recipes."""
    if members := members_of(word):
        raise UsageError(f"{word} is a study; name one of its recipes ({', '.join(members)}), or compare them all")


def film_of(runs: Runs, words: Sequence[str]) -> Path | None:
    """The film of a comparison of the same runs, if one was made."""
    for film in (runs.compared / FILM, *sorted(runs.compared.glob(f"*/{FILM}"))):
        if film.is_file() and sorted(_recorded(film.with_name(COMPARISON_RECORD), "runs")) == sorted(words):
            return film
    return None


def policy_stages() -> list[str]:
    """Stages that leave a policy, the one to prefer first."""
    return [name for name, stage in reversed(STAGES.items()) if stage.leaves_policy]
