"""`iowbc schema`: the JSON Schema of a recipe, for editors."""

import json
import sys
from pathlib import Path
from typing import Any

from iowbc.recipe.recipe import Recipe


def write_schema(output: Path | None) -> None:
    """Write the schema to a file, or print it."""
    text = json.dumps(recipe_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        sys.stdout.write(text)
    else:
        output.write_text(text, encoding="utf-8")


def recipe_schema() -> dict[str, Any]:
    """JSON Schema of a recipe file: the recipe's fields with their sentences, and `extends`."""
    schema = Recipe.model_json_schema()
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    schema["properties"] = {
        "extends": {"type": "string", "description": "Recipe file, relative to this one, that this one changes."},
        **schema["properties"],
    }
    schema["required"] = [name for name in schema.get("required", []) if name != "name"]
    return schema
