"""Output of commands: plain lines, tables, paths, the progress of a film, and JSON for other programs."""

import os
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic_core import to_json
from rich.console import Console
from rich.table import Table

FOLDED = ("metrics", "finished stages", "used by", "recipe", "point", "why", "found")
"""Columns whose text may go on in the next line."""
NARROW = 72
"""Width of a terminal below which every column may fold [characters]."""
INTERVAL = 10.0
"""Seconds between two lines about a film."""
PIPE_WIDTH = 160
"""Characters in a line of a table where the output is not a terminal."""


def stdout_console() -> Console:
    """The console of standard output; a terminal without cursor control counts as none."""
    columns = os.environ.get("COLUMNS", "")
    width = int(columns) if columns.isdecimal() and int(columns) > 0 else PIPE_WIDTH
    dumb = os.environ.get("TERM", "") in ("dumb", "unknown")
    return Console(width=None if sys.stdout.isatty() else width, force_terminal=False if dumb else None)


def plain_table(*columns: str) -> Table:
    """An empty table with these columns; in a narrow terminal each may fold, so that none is lost."""
    table, narrow = Table(box=None, padding=(0, 1, 0, 0)), stdout_console().width < NARROW
    for name in columns:
        table.add_column(name, no_wrap=not narrow and name not in FOLDED, overflow="fold")
    return table


def hanging(line: str, width: int, indent: int) -> str:
    """Indent a line; continuation lines are indented by two more characters."""
    first, others = " " * indent, " " * (indent + 2)
    return textwrap.fill(line, width, initial_indent=first, subsequent_indent=others, break_on_hyphens=False)


def tell(console: Console, text: str) -> None:
    """Print a text as it is, however wide."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)


def shown_path(path: Path) -> str:
    """A path relative to the working folder, if it is below it."""
    relative = os.path.relpath(path)
    return relative if not relative.startswith("..") else str(path)


def print_json(console: Console, data: Any) -> None:
    """Print data as JSON, with null for NaN and infinity."""
    tell(console, to_json(data, indent=2, inf_nan_mode="null").decode("utf-8"))


def film_progress(console: Console, film: Path | None) -> Callable[[float, float], None]:
    """A function that prints the time drawn and the total [s] of a film, if there is one, every few seconds."""
    if film is None:
        return lambda seconds, duration: None
    tell(console, f"{film}: sets up the simulation")
    said = time.monotonic()

    def say(seconds: float, duration: float) -> None:
        nonlocal said
        if time.monotonic() - said >= INTERVAL:
            said = time.monotonic()
            tell(console, f"{film}: {seconds:.0f} of {duration:.0f} s")

    return say
