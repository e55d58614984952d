"""`iowbc diff A B`: how two recipes or two artifacts differ in recipe, keys, versions and metrics."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from iowbc.commands.as_json import print_json
from iowbc.commands.named import Named, named
from iowbc.commands.tables import NARROWEST, folded, hanging
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
GAP = 2
"""Characters between two columns."""
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
        console.print(f"{first} -> {second}", markup=False, highlight=False, soft_wrap=True)
        for place in dict.fromkeys(difference.place for difference in found):
            _draw(console, place, [difference for difference in found if difference.place == place])
    else:
        for difference in found:
            console.print(difference.line, markup=False, highlight=False, soft_wrap=True)


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
    """The differences of one place, old and new values below one another, and what has none below them.

    Long values are folded before names, and names before numbers and keys, which stay whole.
    """
    whole = max((len(text) for one in found for text in (one.old, one.new) if len(text) <= WHOLE), default=0)
    steps = max(len(one.step) for one in found)
    names = max(console.width - INDENT - 3 * GAP - 2 * whole - steps, NARROWEST)
    table = Table.grid(padding=(0, GAP, 0, 0))
    table.add_column(no_wrap=True)
    for _ in range(3):
        table.add_column(overflow="fold")
    for one in found:
        if one.has_values:
            table.add_row(*map(Text, (folded(one.name, names), one.old, one.new, one.step)))
    console.print(Text(place or "recipe", style="bold"))
    console.print(Padding(table, (0, 0, 0, INDENT)))
    for one in found:
        if not one.has_values:
            console.print(hanging(one.name, console.width, INDENT), markup=False, highlight=False)


def difference_lines(a: Named, b: Named) -> list[str]:
    """How two recipes or artifacts differ, a line each; empty where they do not."""
    return [difference.line for difference in differences_of(a, b)]


def differences_of(a: Named, b: Named) -> Iterator[Difference]:
    """How two recipes or artifacts differ."""
    yield from _changes("", "", _today(a.recipe), _today(b.recipe))
    yield from _stages(a, b)


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


def _stages(a: Named, b: Named) -> Iterator[Difference]:
    for stage in dict.fromkeys([*a.artifacts, *b.artifacts]):
        old, new = a.artifacts.get(stage), b.artifacts.get(stage)
        if old is None or new is None:
            yield Difference(stage, f"only in {b.word if old is None else a.word}")
        else:
            yield from _artifacts(stage, old, new, with_recipe=a.recipe is None or b.recipe is None)


def _artifacts(stage: str, old: Artifact, new: Artifact, with_recipe: bool) -> Iterator[Difference]:
    before, after = old.manifest, new.manifest
    if before.key != after.key:
        yield Difference(stage, "key", before.key[:KEY_LENGTH], after.key[:KEY_LENGTH], mark=" ")
    elif before.digest == after.digest:
        return
    if with_recipe:
        yield from _changes(stage, "", old.ingredients.get("recipe", {}), new.ingredients.get("recipe", {}))
    for name, first, second in differences(old.ingredients.get("inputs", {}), new.ingredients.get("inputs", {})):
        yield Difference(stage, f"input {name}", _digest(first), _digest(second))
    if before.version != after.version:
        yield Difference(stage, "stage version", str(before.version), str(after.version))
    yield from _changes(stage, "version of ", before.versions, after.versions)
    changed = changed_code(before.code, after.code)
    if changed:
        yield Difference(stage, f"code of {', '.join(changed)}")
    for name in dict.fromkeys([*old.metrics, *new.metrics]):
        first, second = old.metrics.get(name), new.metrics.get(name)
        if first != second:
            yield Difference(stage, f"metric {name}", _number(first), _number(second), _step(first, second))


def _changes(place: str, prefix: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[Difference]:
    for path, old, new in differences(nested(before), nested(after)):
        yield Difference(place, f"{prefix}{path}", _value(old), _value(new))


def _digest(value: Any) -> str:
    return ABSENT if value is MISSING else str(value)[:KEY_LENGTH]


def _value(value: Any) -> str:
    return ABSENT if value is MISSING else shown(value)


def _number(value: float | None) -> str:
    return ABSENT if value is None else figure(value, 6)


def _step(old: float | None, new: float | None) -> str:
    return figure(new - old, 3, "+") if old is not None and new is not None else ""
