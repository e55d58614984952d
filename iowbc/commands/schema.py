"""`iowbc schema`: the JSON Schema of recipes."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from iowbc.errors import UsageError
from iowbc.recipe.recipe import recipe_schema


def schema(output: Annotated[Path | None, typer.Option(help="Output file (default: print).")] = None) -> None:
    """Write the schema, or print it. Raises `UsageError`."""
    text = json.dumps(recipe_schema(), indent=2, ensure_ascii=False) + "\n"
    if output is None:
        sys.stdout.write(text)
        return
    try:
        output.write_text(text, encoding="utf-8")
    except OSError as error:
        raise UsageError(f"--output {output}: cannot be written: {error.strerror}; name another file") from None
