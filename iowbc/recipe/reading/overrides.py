"""`--set a.b.c=value`: single values of a recipe changed on the command line."""

from collections.abc import Mapping, Sequence

from pydantic import BaseModel

from iowbc.errors import Problem, RecipeError, shown
from iowbc.recipe.reading.document import MAXIMUM_DEPTH, Located, located, merged, read_value
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import Section


def overridden(tree: Located, overrides: Sequence[str]) -> Located:
    """The tree with each override laid upon it, in order.

    A number in the path is an index of a list, which may be one that the recipe has by default. Raises `RecipeError`.
    """
    for override in overrides:
        place = f"--set {override}"
        dotted, equals, text = override.partition("=")
        path = tuple(part.strip() for part in dotted.split("."))
        if not equals or not all(path):
            raise RecipeError([Problem(place, "should read a.b.c=value, for example --set eval.trials=5")])
        if len(path) > MAXIMUM_DEPTH:
            raise RecipeError([Problem(shown(place), f"names {len(path)} levels; no recipe has more than a few")])
        if path[0] == "extends":
            raise RecipeError([Problem(place, "'extends' cannot be set here; name the recipe that extends instead")])
        tree = _replaced(tree, path, read_value(text, place), place, ())
    return tree


def _replaced(tree: Located, path: tuple[str, ...], value: Located, place: str, above: tuple[str, ...]) -> Located:
    if not path:
        return merged(tree, value)
    name, rest = path[0], path[1:]
    if isinstance(tree.value, list):
        count = len(tree.value)
        if not name.isdecimal() or int(name) >= count:
            valid = f"0 to {count - 1}" if count else "none, the list is empty"
            raise RecipeError([Problem(place, f"'{name}' is not an index of '{'.'.join(above)}'; valid: {valid}")])
        items = list(tree.value)
        items[int(name)] = _replaced(items[int(name)], rest, value, place, (*above, name))
        return Located(items, tree.place)
    entries = dict(tree.value) if isinstance(tree.value, dict) else {}
    below = entries.get(name) or _default((*above, name), place)
    entries[name] = _replaced(below, rest, value, place, (*above, name))
    return Located(entries, tree.place)


def _default(path: tuple[str, ...], place: str) -> Located:
    """The list that a recipe has at a path when it says nothing there; anything else starts empty."""
    value: object = Recipe(name="default")
    for name in path:
        if isinstance(value, Mapping):
            value = value.get(name)
        else:
            value = getattr(value, name) if isinstance(value, Section) and name in type(value).model_fields else None
    if not isinstance(value, (list, tuple)):
        return Located({}, place)
    items = [item.model_dump(mode="json") if isinstance(item, BaseModel) else item for item in value]
    return Located([located(item, "default") for item in items], place)
