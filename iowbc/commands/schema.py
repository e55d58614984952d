"""`iowbc schema`: the JSON Schema of a recipe, for editors."""

import json
import sys
from pathlib import Path
from typing import Any

from iowbc.errors import UsageError
from iowbc.recipe.recipe import Recipe


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
    """JSON Schema of a recipe file: the recipe's fields with their sentences, and `extends`.

    No key is required, for a section may hold any part of its keys; `iowbc plan` names what an entry of a list lacks.
    """
    schema = Recipe.model_json_schema()
    for definition in (schema, *schema["$defs"].values()):
        definition.pop("required", None)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    extends = {"type": "string", "description": "Recipe file, relative to this one, that this one changes."}
    schema["properties"] = {"extends": extends, **schema["properties"]}
    return schema
