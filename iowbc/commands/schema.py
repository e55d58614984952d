"""`iowbc schema`: the JSON Schema of a recipe, for editors."""

import ast
import functools
import inspect
import itertools
import json
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from iowbc.errors import UsageError
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import Section


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
    sections = {section.__name__: section for section in _sections(Section)}
    for name, definition in {Recipe.__name__: schema, **schema["$defs"]}.items():
        definition.pop("required", None)
        for field, entry in definition.get("properties", {}).items():
            if sentence := _sentences(sections[name]).get(field):
                entry["description"] = sentence
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    extends = {"type": "string", "description": "Recipe file, relative to this one, that this one changes."}
    schema["properties"] = {"extends": extends, **schema["properties"]}
    return schema


def _sections(base: type[Section]) -> Iterator[type[Section]]:
    for section in base.__subclasses__():
        yield section
        yield from _sections(section)


@functools.cache
def _sentences(section: type[Section]) -> dict[str, str]:
    """The string below each field of a class and its bases, by the field's name. Read here alone: pydantic's
    `use_attribute_docstrings` reads the source of every section whenever a command starts."""
    bases = [_sentences(base) for base in section.__bases__ if issubclass(base, Section)]
    (definition,) = ast.parse(textwrap.dedent(inspect.getsource(section))).body
    assert isinstance(definition, ast.ClassDef)
    own = {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in itertools.pairwise(definition.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
    return {name: sentence for base in bases for name, sentence in base.items()} | own
