"""`iowbc schema`: the JSON Schema of a recipe, for editors."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from iowbc.errors import UsageError
from iowbc.recipe.recipe import Recipe

DEFINITIONS = "#/$defs/"
WHOLE = "Alone"
"""Ending of the definition of a section that changes nothing and so needs all that it requires."""


def write_schema(output: Path | None) -> None:
    """Write the schema to a file, or print it."""
    text = json.dumps(recipe_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        sys.stdout.write(text)
    else:
        try:
            output.write_text(text, encoding="utf-8")
        except OSError as error:
            raise UsageError(f"--output {output}: cannot be written: {error.strerror}; name another file") from None


def recipe_schema() -> dict[str, Any]:
    """JSON Schema of a recipe file: the recipe's fields with their sentences, and `extends`."""
    schema = Recipe.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["properties"] = {
        "extends": {"type": "string", "description": "Recipe file, relative to this one, that this one changes."},
        **schema["properties"],
    }
    sections = schema["$defs"]
    whole = {name: section for name, section in sections.items() if "required" in section}
    schema["$defs"] = {name: _changing(section, whole) for name, section in sections.items()}
    schema["$defs"] |= {f"{name}{WHOLE}": section for name, section in whole.items()}
    return _changing(schema, whole)


def _changing(section: dict[str, Any], whole: Mapping[str, Any]) -> dict[str, Any]:
    """A section that changes a default: any part of its keys; the items of its lists and mappings stand alone."""
    changed = {name: value for name, value in section.items() if name not in ("required", "$defs")}
    if "properties" in section:
        changed["properties"] = {name: _standing(value, whole) for name, value in section["properties"].items()}
    if isinstance(section.get("additionalProperties"), Mapping):
        changed["additionalProperties"] = _standing(section["additionalProperties"], whole, alone=True)
    return changed | ({"$defs": section["$defs"]} if "$defs" in section else {})


def _standing(part: Any, whole: Mapping[str, Any], alone: bool = False) -> Any:
    """A part of a schema in which what stands alone refers to sections with all that they require."""
    if isinstance(part, list):
        return [_standing(item, whole, alone) for item in part]
    if not isinstance(part, Mapping):
        return part
    made = {}
    for name, value in part.items():
        if name == "$ref" and alone and value.removeprefix(DEFINITIONS) in whole:
            made[name] = f"{value}{WHOLE}"
        elif name == "default":
            made[name] = value
        else:
            made[name] = _standing(value, whole, alone or name in ("items", "prefixItems", "additionalProperties"))
    return made
