"""A resolved recipe as YAML."""

import yaml

from iowbc.recipe.reading.document import IMPLICIT
from iowbc.recipe.recipe import Recipe


class _Dumper(getattr(yaml, "CSafeDumper", yaml.SafeDumper)):  # type: ignore[misc]
    """Puts in quotes what any version of YAML reads as something else than text: PyYAML alone leaves `1e3` bare."""


for _tag, _pattern, _first in IMPLICIT:
    _Dumper.add_implicit_resolver(_tag, _pattern, _first)


def as_yaml(recipe: Recipe) -> str:
    """Every field with its value, in the order of the recipe's sections."""
    return str(yaml.dump(recipe.model_dump(mode="json"), Dumper=_Dumper, sort_keys=False))
