"""Tables without lines, as every command prints them."""

import textwrap
from collections.abc import Sequence

from rich.columns import Columns
from rich.table import Table
from rich.text import Text

from iowbc.pipeline.console.wording import figure
from iowbc.pipeline.store.artifact import Artifact

FOLDED = ("metrics", "finished stages", "used by", "recipe", "point", "why")
"""Columns whose text may go on in the next line."""
NARROW = 100
"""Terminals of fewer characters than this leave out what `show` tells."""


def plain_table(*columns: str) -> Table:
    """An empty table with these columns."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    for name in columns:
        table.add_column(name, no_wrap=name not in FOLDED, overflow="fold")
    return table


def hanging(line: str, width: int, indent: int) -> str:
    """A line to the right of its heading, and what of it does not fit two characters further to the right."""
    first, others = " " * indent, " " * (indent + 2)
    return textwrap.fill(line, width, initial_indent=first, subsequent_indent=others, break_on_hyphens=False)


def metric_columns(artifact: Artifact) -> Columns:
    """All metrics of an artifact, in as many columns as fit."""
    cells: Sequence[Text] = [
        Text.assemble((f"{name} ", "dim"), figure(value)) for name, value in artifact.metrics.items()
    ]
    return Columns(cells, padding=(0, 2), equal=True, column_first=True)
