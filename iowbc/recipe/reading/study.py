"""A study: a file that names variants, which run one after another and are then compared."""

import re
from collections.abc import Sequence
from pathlib import Path

from iowbc.errors import Problem, RecipeError, shown
from iowbc.recipe.reading.document import Located, plain, read_document
from iowbc.recipe.reading.loading import LoadedRecipe, file_meant_in, load_recipe, read_text, recipe_file
from iowbc.recipe.recipe import LONGEST_NAME, NAME

MOST_VARIANTS = 100
"""Largest number of variants of a study."""
KEYS = ("name", "description", "variants")
"""Permitted keys of a study file; all other settings belong to the variants."""


def load_study(word: str | Path, overrides: Sequence[str] = ()) -> tuple[LoadedRecipe, ...]:
    """The variants of a study file, each with the overrides; empty for an ordinary recipe. They are named as on the
    command line, or by a path relative to the file. Raises `RecipeError`."""
    file = recipe_file(word)
    tree = read_document(read_text(str(file), f"{file}:1:1"), str(file))
    if not isinstance(tree.value, dict) or "variants" not in tree.value:
        return ()
    entries = tree.value
    problems = [
        Problem(entry.place, f"key '{key}': a recipe that names variants holds {', '.join(KEYS)} alone")
        for key, entry in entries.items()
        if key not in KEYS
    ]
    name = entries["name"].value if "name" in entries else file.stem.lower()
    if not isinstance(name, str) or not re.fullmatch(NAME, name) or len(name) > LONGEST_NAME:
        place = entries["name"].place if "name" in entries else tree.place
        text = f"up to {LONGEST_NAME} lower-case letters, digits, `-` and `_`; in quotes what reads as a number"
        problems.append(Problem(place, f"key 'name' = {shown(name)}: {text}"))
    if "description" in entries and not isinstance(entries["description"].value, str):
        problems.append(Problem(entries["description"].place, "key 'description': should be a sentence"))
    found = _files(entries["variants"], file, problems)
    if problems:
        raise RecipeError(problems)
    variants = tuple(load_recipe(variant, overrides) for variant in found)
    names = [variant.recipe.name for variant in variants]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        text = f"key 'variants': {', '.join(repeated)} is the name of more than one; give each its own"
        raise RecipeError([Problem(entries["variants"].place, text)])
    return variants


def _files(variants: Located, file: Path, problems: list[Problem]) -> list[Path]:
    items = variants.value if isinstance(variants.value, list) else []
    if not 2 <= len(items) <= MOST_VARIANTS:
        given = f"of {len(items):,}" if isinstance(variants.value, list) else shown(plain(variants))
        text = f"key 'variants': should be a list of 2 to {MOST_VARIANTS} recipes, not {given}"
        problems.append(Problem(variants.place, text))
        return []
    found = []
    for item in items:
        if not isinstance(item.value, str) or not item.value or "\0" in item.value:
            problems.append(Problem(item.place, f"key 'variants': {shown(plain(item))} is no recipe's name or file"))
            continue
        found.append(file_meant_in(file.parent, item.value))
        try:
            read_text(str(found[-1]), item.place)
        except RecipeError as error:
            problems.extend(error.problems)
    return found
