"""Recipes with a few other values, for tests."""

from collections.abc import Mapping
from typing import Any

from iowbc.recipe.recipe import Recipe


def changed(section: Any, path: str, value: Any) -> Any:
    """A recipe section with one field, by dotted path, at another value."""
    name, _, rest = path.partition(".")
    return section.model_copy(update={name: changed(getattr(section, name), rest, value) if rest else value})


def with_changes(recipe: Recipe, changes: Mapping[str, Any]) -> Recipe:
    """The recipe with fields at other values, checked."""
    for path, value in changes.items():
        recipe = changed(recipe, path, value)
    return Recipe.model_validate(recipe.model_dump())
