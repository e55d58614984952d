"""Finds and reads a recipe file: inheritance, `--set` overrides, validation, and where each value came from."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from iowbc.errors import Problem, RecipeError, nearest, shown
from iowbc.files import read_limited
from iowbc.recipe.beside import EmbeddedFile
from iowbc.recipe.reading.document import MAXIMUM_DEPTH, Located, leaves, located, merged, read_document, read_value
from iowbc.recipe.reading.validation import defaults, models_at, validate
from iowbc.recipe.recipe import Recipe

SUFFIXES = (".yaml", ".yml")
PACKAGE = Path(__file__).resolve().parents[2]
FOLDERS = (Path("recipes"), PACKAGE.parent / "recipes", PACKAGE / "recipes")
"""Folders in which recipes are found by name, in order of precedence."""
LARGEST_FILE = 1_000_000
"""Largest size of a recipe file [bytes]."""
LONGEST_PATH = 300
"""Number of trailing characters of an unreadable path shown in an error."""
LONGEST_CHAIN = 20
"""Largest length of a chain of `extends`."""
OWN_KEYS = ("name", "description")
"""Keys that a recipe never inherits, because they identify the experiment."""


def recipe_file(word: str | Path) -> Path:
    """Resolve a path, or the name of a recipe with or without extension (`full`, `experts/quick`), to a recipe file.

    Names are searched in `./recipes`, the recipes of this checkout, and those of the installed package; the first match
    counts. Without a match the word is returned as a path, and reading it raises the error.
    """
    path = Path(word)
    if os.path.isfile(path) or ".." in path.parts:
        return path
    return next(filter(os.path.isfile, (file for folder in FOLDERS for file in _spelled(folder, path))), path)


def file_meant_in(folder: Path, word: str) -> Path:
    """Resolve `extends`, `teacher.start` or one of `variants` in a recipe in `folder`: a file in that folder, with or
    without extension, else as `recipe_file` does."""
    beside = _spelled(folder, word)
    return next(filter(os.path.isfile, (*beside, recipe_file(word))), beside[0])


def _spelled(folder: Path, word: str | Path) -> list[Path]:
    """The paths in a folder that a name with or without extension may mean."""
    return [Path(os.path.normpath(folder / f"{word}{ending}")) for ending in ("", *SUFFIXES)]


def known_files(inside: Path = Path()) -> Iterator[Path]:
    """Recipes that can be named without their folder, or as `experts/NAME` for those in a folder of recipes, in order
    of precedence."""
    for folder in FOLDERS:
        for suffix in SUFFIXES:
            yield from sorted((folder / inside).glob(f"*{suffix}"))


def overridden(tree: Located, overrides: Sequence[str]) -> Located:
    """Apply the overrides to the tree, in order. A number in a path is an index of a list, which may be a default of
    the recipe. Raises `RecipeError`."""
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
    """The recipe's default list at a path; for any other default, an empty tree."""
    found: Located | None = defaults()
    for name in path:
        found = found.value.get(name) if found is not None and isinstance(found.value, dict) else None
    return found if found is not None and isinstance(found.value, list) else Located({}, place)


def with_files(tree: Located, folder: Path) -> Located:
    """Embed the content of all named files; paths are relative to the recipe file that contains them, or on the command
    line to `folder`. Raises `RecipeError`."""
    problems = []

    def taken_in(leaf: Located, path: tuple[str, ...] = ()) -> Located:
        if isinstance(leaf.value, dict):
            return Located({name: taken_in(entry, (*path, name)) for name, entry in leaf.value.items()}, leaf.place)
        kinds = [model for model in models_at(path) if issubclass(model, EmbeddedFile)]
        if not kinds or not isinstance(leaf.value, str):
            return leaf
        below = folder if leaf.place.startswith("--set ") else Path(leaf.place.rsplit(":", 2)[0]).parent
        try:
            return located(kinds[0].taken_in(below / leaf.value, leaf.value).model_dump(mode="json"), leaf.place)
        except ValueError as error:
            problems.append(Problem(leaf.place, f"key '{'.'.join(path)}' = {shown(leaf.value)}: {error}"))
            return leaf

    whole = taken_in(tree)
    if problems:
        raise RecipeError(problems)
    return whole


@dataclass(frozen=True)
class LoadedRecipe:
    """A recipe, the file it came from, and the place of every value in it."""

    recipe: Recipe
    file: Path
    overrides: tuple[str, ...]
    places: Mapping[str, str]
    """Location of each value set by a file or an override, by dotted path."""

    def place(self, path: str) -> str:
        """Location of the value at a dotted path (`file:line:column`, `--set ...`), or `default`."""
        parts = path.split(".")
        above = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
        below = (known for known in self.places if known.startswith(f"{path}."))
        return next((self.places[known] for known in (*above, *below) if known in self.places), "default")


def load_recipe(file: Path | str, overrides: Sequence[str] = ()) -> LoadedRecipe:
    """Load, inherit, override and validate. Raises `RecipeError` with every problem and its line.

    `file` may also be the name of a recipe in a folder `recipes`, here or in the package. A recipe's name defaults to
    its file's name; name and description are not inherited.
    """
    file = recipe_file(file)
    tree = _resolve(os.fspath(file), (), f"{file}:1:1")
    if isinstance(tree.value, dict) and "name" not in tree.value:
        tree = Located({"name": Located(Path(file).stem.lower(), f"{file}:1:1"), **tree.value}, tree.place)
    tree = with_files(overridden(tree, overrides), Path(file).parent)
    recipe = validate(tree)
    places = {".".join(path): leaf.place for path, leaf in leaves(tree)}
    loaded = LoadedRecipe(recipe, Path(file), tuple(overrides), places)
    robot, place = recipe.robot, loaded.place("robot")
    if Path(robot).name != robot and not place.startswith("--set "):
        text = f"key 'robot' = {shown(robot)}: a recipe names a folder under robots/; a path is for --set"
        raise RecipeError([Problem(place, text)])
    return loaded


def _resolve(file: str, above: tuple[str, ...], place: str) -> Located:
    """The tree of a file merged into that of the recipe it extends."""
    if os.path.realpath(file) in map(os.path.realpath, above):
        raise RecipeError([Problem(place, f"recipes extend each other in a circle: {' -> '.join((*above, file))}")])
    if len(above) > LONGEST_CHAIN:
        text = f"extends {above[1]}, which extends another, and so on more than {LONGEST_CHAIN} times"
        raise RecipeError([Problem(f"{above[0]}:1:1", text)])
    tree = read_document(read_text(file, place), file)
    if tree.value is None:
        text = "is empty; write at least one line, for example `description: what this tries` or `extends: full.yaml`"
        raise RecipeError([Problem(tree.place, text)])
    if not isinstance(tree.value, dict):
        raise RecipeError([Problem(tree.place, "a recipe is a mapping, `key: value` on each line")])
    entries = dict(tree.value)
    extends = entries.pop("extends", None)
    own = Located(entries, tree.place)
    if extends is None:
        return own
    if not isinstance(extends.value, str) or not extends.value.strip() or "\0" in extends.value:
        raise RecipeError([Problem(extends.place, "key 'extends': should be the name of one recipe file")])
    parent = file_meant_in(Path(file).parent, extends.value)
    base = _resolve(os.fspath(parent), (*above, file), extends.place)
    assert isinstance(base.value, dict)
    inherited = {key: entry for key, entry in base.value.items() if key not in OWN_KEYS}
    return merged(Located(inherited, base.place), own)


def read_text(file: str, place: str) -> str:
    """The text of a recipe file. Raises `RecipeError` if it cannot be read."""
    try:
        return read_limited(Path(file), LARGEST_FILE).decode("utf-8")
    except UnicodeDecodeError as error:
        text = f"is not UTF-8 text ({error.reason} at byte {error.start})"
        raise RecipeError([Problem(f"{file}:1:1", text)]) from None
    except ValueError as error:
        raise RecipeError([Problem(place, f"recipe {error}")]) from None
    except OSError as error:
        reason = "no such file" if isinstance(error, FileNotFoundError) else (error.strerror or "cannot be read")
        named, text = f"recipe {file[-LONGEST_PATH:]}", f"{reason}{_listed(Path(file))}"
        asked_for = place == f"{file}:1:1"
        raise RecipeError([Problem(named, text) if asked_for else Problem(place, f"{named}: {text}")]) from None


def _listed(missing: Path) -> str:
    """Alternatives to a missing file: files beside it, if its name has an extension, and recipes by name."""
    folder, with_ending = missing.parent, missing.suffix in SUFFIXES
    beside = sorted(found.name for found in folder.glob("*.yaml")) if with_ending and folder.is_dir() else []
    inside = folder if not folder.is_absolute() and any(known_files(folder)) else Path()
    found = dict.fromkeys(inside / one.name for one in known_files(inside) if one.parent != folder)
    elsewhere, names = [str(one) for one in found], [str(one.with_suffix("")) for one in found]
    parts = [f"recipes in {folder}: {', '.join(beside)}"] if beside else []
    parts += [f"recipes by name: {', '.join(names)}"] if names else []
    choices = [*beside, *elsewhere] if with_ending else names
    return "".join(f"; {part}" for part in parts) + nearest(str(inside / missing.name), choices)
