"""`--set a.b.c=value`: single values of a recipe changed on the command line."""

from collections.abc import Sequence

from iowbc.errors import Problem, RecipeError, shown
from iowbc.recipe.reading.document import MAXIMUM_DEPTH, Located, merged, read_value
from iowbc.recipe.reading.validation import defaults


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
    found: Located | None = defaults()
    for name in path:
        found = found.value.get(name) if found is not None and isinstance(found.value, dict) else None
    return found if found is not None and isinstance(found.value, list) else Located({}, place)
