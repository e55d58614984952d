"""The part of a recipe that a stage's key holds."""

from collections.abc import Mapping
from typing import Any

from iowbc.pipeline.stage import Stage
from iowbc.recipe.recipe import Recipe


def key_values(recipe: Recipe, deciding: Mapping[str, Any], stage: Stage) -> dict[str, Any]:
    """By dotted path: the values of a recipe that decide a stage's result, and the program's defaults beside them."""
    return {path: slice_value(deciding, path, stage) for path in stage.slice} | dict(stage.defaults(recipe))


def slice_value(values: Mapping[str, Any], path: str, stage: Stage) -> Any:
    """The part at a dotted path of what decides a recipe's results."""
    if path.split(".")[0] in ("execution", "stages"):
        raise ValueError(f"stage {stage.name}: '{path}' must not be part of a key")
    value: Any = values
    for part in path.split("."):
        if not isinstance(value, Mapping) or part not in value:
            raise ValueError(f"stage {stage.name}: its slice names '{path}', which decides nothing in a recipe")
        value = value[part]
    return value
