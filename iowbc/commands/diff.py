"""`iowbc diff A B`: how two recipes or two artifacts differ in recipe, keys, versions and metrics."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from iowbc.commands.lookup import Named, named
from iowbc.commands.printed import hanging, print_json, tell
from iowbc.errors import UsageError, shown
from iowbc.pipeline.code import changed_code
from iowbc.pipeline.console.wording import KEY_LENGTH, figure
from iowbc.pipeline.nested import MISSING, differences, nested
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.finding import SUFFIXES, recipe_file
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe

ABSENT = "(absent)"
"""In place of a value that one of the two has not."""
INDENT = 2
"""Characters by which differences stand to the right of their stage."""
WHOLE = 14
"""A value of at most so many characters, such as a number or the beginning of a key, is never folded."""


def diff(store: Store, console: Console, first: str, second: str, as_json: bool = False) -> None:
    """Print the differences. Each of the two is whatever `show` takes, or a recipe file that has not run."""
    a, b = _either(store, first), _either(store, second)
    if as_json:
        print_json(console, {"first": first, "second": second, "differences": difference_lines(a, b)})
        return
    found = list(differences_of(a, b))
    if not found:
        console.print("no difference")
    elif console.is_terminal:
        tell(console, f"{first} -> {second}")
        for place, own in groupby(found, lambda difference: difference.place):
            _draw(console, place, list(own))
    else:
        for difference in found:
            tell(console, difference.line)


@dataclass(frozen=True)
class Difference:
    """One value that differs."""

    place: str
    """The stage; empty for the recipe."""
    name: str
    old: str = ""
    new: str = ""
    step: str = ""
    """Of a number: by how much."""
    mark: str = ": "
    """Between name and values, where they are written in a line."""

    @property
    def has_values(self) -> bool:
        return bool(self.old or self.new)

    @property
    def line(self) -> str:
        values = f"{self.mark}{self.old} -> {self.new}" if self.has_values else ""
        return f"{f'{self.place}: ' if self.place else ''}{self.name}{values}{f' ({self.step})' if self.step else ''}"


def _draw(console: Console, place: str, found: Sequence[Difference]) -> None:
    """The differences of one place, old and new values side by side, and those without values below."""
    whole = max((len(text) for one in found for text in (one.old, one.new) if len(text) <= WHOLE), default=0)
    table = Table.grid(padding=(0, 2, 0, 0))
    table.add_column(overflow="fold")
    for _ in range(2):
        table.add_column(overflow="fold", min_width=whole)
    table.add_column(no_wrap=True)
    for one in found:
        if one.has_values:
            table.add_row(*map(Text, (one.name, one.old, one.new, one.step)))
    console.print(Text(place or "recipe", style="bold"))
    console.print(Padding(table, (0, 0, 0, INDENT)))
    for one in found:
        if not one.has_values:
            console.print(hanging(one.name, console.width, INDENT), markup=False, highlight=False)


def difference_lines(a: Named, b: Named) -> list[str]:
    """Differences of two recipes or artifacts, a line each; empty where there are none."""
    return [difference.line for difference in differences_of(a, b)]


def differences_of(a: Named, b: Named) -> Iterator[Difference]:
    """Differences of two recipes or artifacts, those of a stage together."""
    yield from _changes("", "", _today(a.recipe), _today(b.recipe))
    for stage in dict.fromkeys([*a.artifacts, *b.artifacts]):
        old, new = a.artifacts.get(stage), b.artifacts.get(stage)
        if old is None or new is None:
            yield Difference(stage, f"only in {b.word if old is None else a.word}")
        else:
            yield from _artifacts(stage, old, new, with_recipe=a.recipe is None or b.recipe is None)


def _either(store: Store, word: str) -> Named:
    """A recipe file counts as it is now, and so does one by its name that has not run; its artifacts are those that it
    used last."""
    file = recipe_file(word)
    there = os.path.isfile(file)
    try:
        found, as_file = named(store, word), there and Path(word).suffix in SUFFIXES
    except UsageError:
        if not there:
            raise
        found, as_file = Named(word, {}), True
    return replace(found, recipe=load_recipe(file).recipe.model_dump(mode="json")) if as_file else found


def _today(recipe: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """A resolved recipe with the defaults of fields that came after it was written; as it is where that fails."""
    try:
        return {} if recipe is None else Recipe.model_validate(recipe).model_dump(mode="json")
    except ValidationError:
        return recipe or {}


def _artifacts(stage: str, old: Artifact, new: Artifact, with_recipe: bool) -> Iterator[Difference]:
    one, other = old.manifest, new.manifest
    if one.key != other.key:
        yield Difference(stage, "key", one.key[:KEY_LENGTH], other.key[:KEY_LENGTH], mark=" ")
    elif one.digest == other.digest:
        return
    if with_recipe:
        yield from _changes(stage, "", old.ingredients.get("recipe", {}), new.ingredients.get("recipe", {}))
    for name, *digests in differences(old.ingredients.get("inputs", {}), new.ingredients.get("inputs", {})):
        texts = [ABSENT if digest is MISSING else str(digest)[:KEY_LENGTH] for digest in digests]
        yield Difference(stage, f"input {name}", *texts)
    if one.version != other.version:
        yield Difference(stage, "stage version", str(one.version), str(other.version))
    yield from _changes(stage, "version of ", one.versions, other.versions)
    if changed := changed_code(one.code, other.code):
        yield Difference(stage, f"code of {', '.join(changed)}")
    for name in dict.fromkeys([*old.metrics, *new.metrics]):
        first, second = old.metrics.get(name), new.metrics.get(name)
        if first != second:
            before, after = (ABSENT if value is None else figure(value, 6) for value in (first, second))
            step = figure(second - first, 3, "+") if first is not None and second is not None else ""
            yield Difference(stage, f"metric {name}", before, after, step)


def _changes(place: str, prefix: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Difference]:
    for path, *values in differences(nested(before), nested(after)):
        texts = [ABSENT if value is MISSING else shown(value) for value in values]
        yield Difference(place, f"{prefix}{path}", *texts)
