"""Validation of a tree of values as a `Recipe`; pydantic's errors are reported by file location and key."""

import functools
import re
import types
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from iowbc.errors import PROBLEMS_TOLD, Problem, RecipeError, nearest, shown
from iowbc.recipe.reading.document import Located, leaves, located, merged, plain
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import ARTIFACT_NAME, InconsistentValues, NamedEntries

LARGEST_NUMBER = 1e12
"""Upper bound on every number in a recipe."""

SEVERAL = re.compile(r"[^,],[^,]|\d\.\.\d")
"""Text that reads as more than one value: `1,2` or `0..4`."""


def validate(tree: Located) -> Recipe:
    """The recipe of a tree merged into the defaults; sections may be partial, also those that are off by default.
    Raises `RecipeError` with all problems."""
    whole = merged(defaults(), _opened(tree, defaults()))
    try:
        recipe = Recipe.model_validate(plain(whole))
    except ValidationError as error:
        errors = error.errors(include_url=False)
        raise RecipeError(_problems(whole, errors), max(0, len(errors) - PROBLEMS_TOLD)) from None
    problems = []
    for path, found in leaves(tree):
        head = f"key '{'.'.join(path)}' = {shown(found.value)}"
        if isinstance(found.value, bool) and type(_value_at(recipe, path)) in (int, float):
            problems.append(Problem(found.place, f"{head}: should be a number, not true or false"))
        elif isinstance(found.value, (int, float)) and abs(found.value) > LARGEST_NUMBER:
            problems.append(Problem(found.place, f"{head}: is larger than any number of a recipe"))
    if problems:
        raise RecipeError(problems)
    return recipe


@functools.cache
def defaults() -> Located:
    """Tree of the default recipe, without the name, which is required."""
    return located(Recipe(name="default").model_dump(mode="json", exclude={"name"}), "default")


def _opened(tree: Located, base: Located, path: tuple[str, ...] = ()) -> Located:
    """The tree with each section that is off by default merged into that section's own defaults."""
    if not isinstance(tree.value, dict):
        return tree
    if base.value is None:
        return merged(_of_its_own(path), tree)
    if not isinstance(base.value, dict):
        return tree
    known = base.value
    entries = {
        name: _opened(entry, known[name], (*path, name)) if name in known else entry
        for name, entry in tree.value.items()
    }
    return Located(entries, tree.place)


def _of_its_own(path: Sequence[str]) -> Located:
    """Defaults of the section at a path, if all its keys have one."""
    for model in models_at(path):
        with suppress(ValidationError):
            return located(model().model_dump(mode="json"), "default")
    return Located(None, "default")


def _problems(tree: Located, errors: Sequence[ErrorDetails]) -> list[Problem]:
    """One problem per location and key; messages of the members of a union about the same value are joined."""
    texts: dict[tuple[str, str], dict[str, None]] = {}
    wrong = {error["loc"][:count] for error in errors for count in range(len(error["loc"]))}
    errors = [error for error in errors if error["type"] != "too_short" or error["loc"] not in wrong]
    for error in errors[:PROBLEMS_TOLD]:
        for place, head, text in _each_problem(tree, error):
            texts.setdefault((place, head), {})[text] = None  # each text once, in order
    problems = [Problem(place, f"{head}: {', or '.join(parts)}") for (place, head), parts in texts.items()]
    return sorted(problems, key=lambda problem: _position(problem.place))


def _position(place: str) -> tuple[str, int, int]:
    """Sort key of a location: file, line and column."""
    rest, _, column = place.rpartition(":")
    file, _, line = rest.rpartition(":")
    return (file, int(line), int(column)) if line.isdecimal() and column.isdecimal() else (place, 0, 0)


def _each_problem(tree: Located, error: ErrorDetails) -> Iterator[tuple[str, str, str]]:
    """Place, `key 'x' = value`, and what is valid, for each problem of an error."""
    reason = error.get("ctx", {}).get("error")
    if isinstance(reason, InconsistentValues):
        for dotted, text in reason.problems:
            path, found = descend(tree, [*error["loc"], *dotted.split(".")])
            yield found.place, value_head(path, found), text
    else:
        yield _problem(tree, error)


def value_head(path: Sequence[str], found: Located, whole: str = "the recipe") -> str:
    """`key 'a.b' = value`, without the value of a section; `whole` for an empty path."""
    head = f"key '{'.'.join(path)}'" if path else whole
    return head if isinstance(found.value, dict) else f"{head} = {shown(plain(found))}"


def _problem(tree: Located, error: ErrorDetails) -> tuple[str, str, str]:
    path, found = descend(tree, error["loc"])
    if error["type"] == "missing":
        name = ".".join((*path, str(error["loc"][-1])))
        return found.place, f"key '{name}'", f"is missing and has no default{_meant(path)}"
    if error["type"] == "extra_forbidden":
        section = path[:-1]
        known = sorted(name for model in models_at(section) for name in model.model_fields)
        where = f"of '{'.'.join(section)}'" if section else "of a recipe"
        hint = nearest(path[-1], known) or _elsewhere(path[-1])
        text = f"is not a key {where}; valid: {', '.join(known) or 'none'}{hint}"
        return found.place, f"key '{'.'.join(path)}' = {shown(plain(found))}", text
    text = error["msg"].removeprefix("Value error, ").replace("Input should", "should")
    if error["type"] == "model_type":
        known = sorted({name for model in models_at(path) for name in model.model_fields})
        text = f"should be a section, with any of the keys {', '.join(known)}"
    if error["type"].endswith("_parsing"):
        text = text.split(",")[0]
    if found.place.startswith("--set ") and isinstance(found.value, str) and SEVERAL.search(found.value):
        text += "; several values are for `iowbc sweep`"
    if error["type"] == "string_pattern_mismatch" and path == ("name",):
        text = "should be lower-case letters, digits, `-` and `_`; give it as `name:` where the file is named otherwise"
    if error["type"] == "string_pattern_mismatch" and error.get("ctx", {}).get("pattern") == ARTIFACT_NAME:
        text = "should be a recipe file, as in full.yaml, or the first characters (8 or more) of an artifact's key"
    if error["type"] == "int_from_float" and found.place.startswith("--set "):
        text += "; random draws of a sweep are integers with `whole: true`"
    if error["type"] == "string_type" and isinstance(found.value, (int, float)):
        text = "should be text; in quotes, a word that reads as a number is"
    if error["type"] in ("literal_error", "enum") and isinstance(found.value, str):
        text += nearest(found.value, re.findall(r"'([^']*)'", str(error.get("ctx", {}).get("expected", ""))))
    return found.place, value_head(path, found), text


def _meant(path: Sequence[str]) -> str:
    """`; did you mean 'x'?` for an incomplete custom entry whose name is close to a known one."""
    for model in models_at(path[:-1]) if path else ():
        if issubclass(model, NamedEntries) and path[-1] not in model.model_fields:
            return nearest(path[-1], model.model_fields)
    return ""


def descend(tree: Located, location: Sequence[int | str]) -> tuple[tuple[str, ...], Located]:
    """The deepest value of the file on the path of an error's location; names of union members are skipped."""
    path: list[str] = []
    for part in location:
        if isinstance(tree.value, dict) and str(part) in tree.value:
            tree = tree.value[str(part)]
        elif isinstance(tree.value, list) and str(part).isdecimal() and int(part) < len(tree.value):
            tree = tree.value[int(part)]
        else:
            continue
        path.append(str(part))
    return tuple(path), tree


def models_at(path: Sequence[str]) -> list[type[BaseModel]]:
    """The sections that may stand at a path."""
    kinds: list[Any] = [Recipe]
    for name in path:
        kinds = [kind for above in kinds for kind in _alternatives(_inside(above, name))]
    return list(filter(_is_section, kinds))


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _alternatives(annotation: Any) -> Iterator[Any]:
    """Members of a union, or the annotation itself, without its metadata."""
    if get_origin(annotation) in (Union, types.UnionType):
        for member in get_args(annotation):
            yield from _alternatives(member)
    elif get_origin(annotation) is Annotated:
        yield from _alternatives(get_args(annotation)[0])
    else:
        yield annotation


def _inside(kind: Any, name: str) -> Any:
    """Annotation of the entry `name` of a section or a collection; None if it has none."""
    if not _is_section(kind):
        return next((argument for argument in reversed(get_args(kind)) if argument is not Ellipsis), None)
    if name in kind.model_fields:
        return kind.model_fields[name].annotation
    return get_args(kind.__annotations__["__pydantic_extra__"])[1] if issubclass(kind, NamedEntries) else None


def _elsewhere(name: str) -> str:
    """`; did you mean 'section.name'?` for a misplaced key that belongs to exactly one other section."""
    places = [path for path in _known_paths(Recipe, ()) if path[-1] == name]
    return f"; did you mean '{'.'.join(places[0])}'?" if len(places) == 1 else ""


def _known_paths(model: type[BaseModel], path: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    for name, field in model.model_fields.items():
        yield (*path, name)
        for section in filter(_is_section, _alternatives(field.annotation)):
            yield from _known_paths(section, (*path, name))


def _value_at(value: Any, path: Sequence[str]) -> Any:
    for name in path:
        value = value[int(name)] if isinstance(value, (tuple, list)) else dict(value).get(name)
    return value
