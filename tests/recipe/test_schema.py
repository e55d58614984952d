"""The JSON Schema describes every field of a recipe in a sentence."""

from collections.abc import Iterator
from typing import Any

from iowbc.recipe.recipe import recipe_schema


def fields(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, model in {"Recipe": schema, **schema["$defs"]}.items():
        for field, description in model.get("properties", {}).items():
            yield f"{name}.{field}", description


def text_of(part: dict[str, Any]) -> str:
    return str(part.get("description", ""))


def test_every_field_has_a_sentence() -> None:
    schema = recipe_schema()
    sections = {f"#/$defs/{name}": section for name, section in schema["$defs"].items()}
    bare = [(name, sections.get(field.get("$ref", ""), {})) for name, field in fields(schema) if not text_of(field)]
    assert [name for name, section in bare if not text_of(section)] == []


def test_unknown_keys_are_refused_everywhere_and_extends_is_known() -> None:
    schema = recipe_schema()
    assert schema["properties"]["extends"]["type"] == "string"
    others = {name: model["additionalProperties"] for name, model in schema["$defs"].items() if "properties" in model}
    named = {name: others.pop(name) for name in ("Scenes", "SceneShares", "Grasps", "Loads", "Tasks")}
    assert set(others.values()) == {False}
    assert all("type" in entry or "$ref" in entry for entry in named.values())
    assert "required" not in schema
