"""`iowbc diff A B`: differences of two recipes or two artifacts in recipe, keys, versions and metrics."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from iowbc.commands import options
from iowbc.commands.lookup import named, require_no_study
from iowbc.commands.printed import hanging, print_json, stdout_console, tell
from iowbc.errors import UsageError, shown
from iowbc.pipeline.code import changed_code
from iowbc.pipeline.console.wording import KEY_LENGTH, figure
from iowbc.pipeline.nested import MISSING, differences, nested
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.runs import Runs
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import SUFFIXES, load_recipe, recipe_file
from iowbc.recipe.recipe import Recipe
from iowbc.report.runs import Run


def diff(
    first: options.Named,
    second: options.Named,
    as_json: options.AsJson = False,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Print the differences. Arguments as for `show`, or a recipe file that has not run."""
    store, console = Store(Runs(runs)), stdout_console()
    lines = list(difference_lines(_either(store, first), _either(store, second)))
    if as_json:
        print_json(console, {"first": first, "second": second, "differences": lines})
        return
    for line in lines or ["no difference"]:
        tell(console, hanging(line, console.width, 0) if console.is_terminal else line)


def difference_lines(a: Run, b: Run) -> Iterator[str]:
    """Differences of two recipes or artifacts, one per line, grouped by stage."""
    if recipes := a.recipe and b.recipe:
        yield from _changes("", _today(a.recipe), _today(b.recipe))
    for stage in dict.fromkeys([*a.artifacts, *b.artifacts]):
        old, new = a.artifacts.get(stage), b.artifacts.get(stage)
        if old is None or new is None:
            yield f"{stage}: only in {b.label if old is None else a.label}"
        else:
            for text in _of_artifacts(old, new, with_recipe=not recipes):
                yield f"{stage}: {text}"


def _either(store: Store, word: str) -> Run:
    """The run that a word names; the recipe of a file, or of a name that has not run here, is read from the file."""
    file = recipe_file(word)
    there = os.path.isfile(file)
    try:
        found = named(store, word)
        shipped = all(artifact.published for artifact in found.artifacts.values())
        as_file = there and (shipped or Path(word).suffix in SUFFIXES)
    except UsageError:
        if not there:
            raise
        require_no_study(word)
        found, as_file = Run(word, {}), True
    return replace(found, recipe=load_recipe(file).recipe.model_dump(mode="json")) if as_file else found


def _today(recipe: Mapping[str, Any]) -> Mapping[str, Any]:
    """A resolved recipe with the defaults of fields that came after it was written; as it is where that fails."""
    try:
        return Recipe.model_validate(recipe).model_dump(mode="json")
    except ValidationError:
        return recipe


def _of_artifacts(old: Artifact, new: Artifact, with_recipe: bool) -> Iterator[str]:
    before, after = old.manifest, new.manifest
    if before.key != after.key:
        yield f"key {before.key[:KEY_LENGTH]} -> {after.key[:KEY_LENGTH]}"
    elif before.digest == after.digest:
        return
    if with_recipe:
        yield from _changes("", old.ingredients.get("recipe", {}), new.ingredients.get("recipe", {}))
    for name, *digests in differences(old.ingredients.get("inputs", {}), new.ingredients.get("inputs", {})):
        yield f"input {name}: {' -> '.join(str(digest)[:KEY_LENGTH] for digest in digests)}"
    if before.version != after.version:
        yield f"stage version: {before.version} -> {after.version}"
    yield from _changes("version of ", before.versions, after.versions)
    if changed := changed_code(before.code, after.code):
        yield f"code of {', '.join(changed)}"
    for name in dict.fromkeys([*old.metrics, *new.metrics]):
        first, second = old.metrics.get(name), new.metrics.get(name)
        if first != second:
            values = " -> ".join(str(MISSING) if value is None else figure(value, 6) for value in (first, second))
            step = f" ({figure(second - first, 3, '+')})" if first is not None and second is not None else ""
            yield f"metric {name}: {values}{step}"


def _changes(prefix: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[str]:
    for path, *values in differences(nested(before), nested(after)):
        yield f"{prefix}{path}: {' -> '.join(map(shown, values))}"
