"""`iowbc diff A B`: how two recipes or two artifacts differ in recipe, keys, versions and metrics."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console

from iowbc.commands.as_json import print_json
from iowbc.commands.named import Named, named
from iowbc.errors import UsageError, shown
from iowbc.pipeline.nested import MISSING, differences, nested
from iowbc.pipeline.planner import changed_code
from iowbc.pipeline.store.artifact import Artifact
from iowbc.pipeline.store.store import Store
from iowbc.recipe.reading.loading import load_recipe


def diff(store: Store, console: Console, first: str, second: str, as_json: bool = False) -> None:
    """Print the differences. Each of the two is whatever `show` takes, or a recipe file that has not run."""
    a, b = _either(store, first), _either(store, second)
    if as_json:
        print_json(console, {"first": first, "second": second, "differences": difference_lines(a, b)})
        return
    for line in difference_lines(a, b) or ["no difference"]:
        console.print(line, markup=False, highlight=False, soft_wrap=True)


def difference_lines(a: Named, b: Named) -> list[str]:
    """How two recipes or artifacts differ, a line each; empty where they do not."""
    return [*_recipes(a, b), *_stages(a, b)]


def _either(store: Store, word: str) -> Named:
    """A recipe file counts as it is now; its artifacts are those that it used last."""
    if Path(word).suffix in (".yaml", ".yml") and Path(word).is_file():
        resolved = load_recipe(word).recipe.model_dump(mode="json")
        try:
            return Named(word, named(store, resolved["name"]).artifacts, resolved)
        except UsageError:
            return Named(word, {}, resolved)
    return named(store, word)


def _recipes(a: Named, b: Named) -> Iterator[str]:
    yield from _changes("", a.recipe or {}, b.recipe or {})


def _stages(a: Named, b: Named) -> Iterator[str]:
    for stage in dict.fromkeys([*a.artifacts, *b.artifacts]):
        old, new = a.artifacts.get(stage), b.artifacts.get(stage)
        if old is None or new is None:
            yield f"{stage}: only in {b.word if old is None else a.word}"
        else:
            yield from _artifacts(stage, old, new, with_recipe=a.recipe is None or b.recipe is None)


def _artifacts(stage: str, old: Artifact, new: Artifact, with_recipe: bool) -> Iterator[str]:
    before, after = old.manifest, new.manifest
    if before.key != after.key:
        yield f"{stage}: key {before.key[:12]} -> {after.key[:12]}"
    elif before.digest == after.digest:
        return
    if with_recipe:
        yield from _changes(f"{stage}: ", old.ingredients.get("recipe", {}), new.ingredients.get("recipe", {}))
    yield from _changes(f"{stage}: input ", old.ingredients.get("inputs", {}), new.ingredients.get("inputs", {}))
    yield from _changes(f"{stage}: stage version ", {"": before.version}, {"": after.version})
    yield from _changes(f"{stage}: version of ", before.versions, after.versions)
    changed = changed_code(before.code, after.code)
    if changed:
        yield f"{stage}: code of {', '.join(changed)}"
    for name in dict.fromkeys([*old.metrics, *new.metrics]):
        values = old.metrics.get(name), new.metrics.get(name)
        if values[0] != values[1]:
            yield f"{stage}: metric {name}: {_number(values[0])} -> {_number(values[1])}{_step(*values)}"


def _changes(prefix: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> Iterator[str]:
    for path, old, new in differences(nested(before), nested(after)):
        yield f"{prefix}{path}: {_value(old)} -> {_value(new)}"


def _value(value: Any) -> str:
    return "(absent)" if value is MISSING else shown(value)


def _number(value: float | None) -> str:
    return "(absent)" if value is None else f"{value:.6g}"


def _step(old: float | None, new: float | None) -> str:
    return f" ({new - old:+.3g})" if old is not None and new is not None else ""
