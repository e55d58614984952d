"""Every value of a recipe can be changed alone, on the command line and in a file, and editors agree."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from iowbc.recipe.reading.document import located, plain
from iowbc.recipe.reading.loading import overridden
from iowbc.recipe.reading.validation import validate
from iowbc.recipe.recipe import Recipe, recipe_schema

RECIPES = Path(__file__).parents[2] / "recipes"
USUAL = Recipe(name="usual")


def leaves(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Dotted path and value of everything in a recipe's data; an empty collection is a value."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    if not value or not items:
        yield ".".join(path), value
    for name, below in items:
        yield from leaves(below, (*path, str(name)))


@pytest.fixture(scope="module")
def schema() -> Any:
    """Validates data by the published schema."""
    return jsonschema.Draft202012Validator(recipe_schema())


def test_each_value_can_be_set_alone_and_the_published_schema_allows_it(schema: Any) -> None:
    said = located({"name": "usual"}, "file.yaml:1:1")
    count = 0
    for path, value in leaves(USUAL.model_dump(mode="json")):
        tree = overridden(said, [f"{path}={json.dumps(value)}"])
        assert validate(tree) == USUAL, path
        schema.validate(plain(tree))
        count += 1
    assert count > 300


@pytest.mark.parametrize(
    "given",
    [
        {"task": {"reward": {"sync": {"height": {"weight": 2.0}}}}},
        {"simulation": {"scenes": {"lift": {"object": {"mass": 9.0}}}}},
        {"rg": {"sampling": {"pitch": {"high": 1.2}}}},
    ],
)
def test_a_part_of_a_section_keeps_the_rest_of_its_default(schema: Any, given: dict[str, Any]) -> None:
    recipe = validate(located({"name": "mine", **given}, "file.yaml:1:1"))
    after = dict(leaves(recipe.model_dump(mode="json")))
    before = dict(leaves(USUAL.model_dump(mode="json")))
    ((path, value),) = leaves(given)
    assert {name for name in after if after[name] != before[name]} == {"name", path}
    assert after[path] == value
    schema.validate({"name": "mine", **given})


def test_the_schema_knows_every_key_of_a_section(schema: Any) -> None:
    with pytest.raises(jsonschema.ValidationError, match="Additional properties"):
        schema.validate({"name": "mine", "task": {"reward": {"sync": {"height": {"wieght": 2}}}}})


@pytest.mark.parametrize("file", sorted(RECIPES.rglob("*.yaml")), ids=lambda file: file.stem)
def test_the_schema_allows_every_shipped_recipe_and_study(schema: Any, file: Path) -> None:
    schema.validate(yaml.safe_load(file.read_text(encoding="utf-8")))
