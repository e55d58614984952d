"""A resolved recipe as YAML."""

import yaml

from iowbc.recipe.recipe import Recipe

_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def as_yaml(recipe: Recipe) -> str:
    """Every field with its value, in the order of the recipe's sections."""
    return str(yaml.dump(recipe.model_dump(mode="json"), Dumper=_DUMPER, sort_keys=False))
