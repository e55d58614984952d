"""Markdown tables of results, drawn on a terminal of any width."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from rich.cells import cell_len
from rich.console import Group
from rich.table import Table
from rich.text import Text

INTERVAL = re.compile(r" ± [\d.]+(?:e[-+]\d+)?")
"""Half an interval behind a mean."""
PAPER = "paper "
"""What the head of a column begins with that holds the paper's own figure."""


@dataclass(frozen=True)
class Cells:
    """A table of texts."""

    caption: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def read_table(markdown: str) -> Cells:
    """The table in a Markdown text: a caption in asterisks, and rows between bars."""
    lines = markdown.splitlines()
    rows = [tuple(cell.strip() for cell in line.strip().strip("|").split("|")) for line in lines if line[:1] == "|"]
    caption = next((line.strip("*") for line in lines if line.startswith("*")), "")
    return Cells(caption, rows[0], tuple(rows[2:]))


def drawn(cells: Cells, width: int) -> Group:
    """A table of at most so many characters, below the first words of its caption.

    What does not fit goes in this order: the paper's figures, the intervals, columns from the right.
    """
    title = re.split(r"[:.](?: |$)", cells.caption, maxsplit=1)[0]
    head, rows = cells.head, cells.rows
    if _width(head, rows) > width:
        own = [place for place, name in enumerate(head) if not name.startswith(PAPER)]
        head, rows = tuple(head[place] for place in own), tuple(tuple(row[place] for place in own) for row in rows)
    if _width(head, rows) > width:
        rows = tuple(tuple(INTERVAL.sub("", cell) for cell in row) for row in rows)
    while len(head) > 2 and _width(head, rows) > width:
        head, rows = head[:-1], tuple(row[:-1] for row in rows)
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for place, name in enumerate(head):
        table.add_column(Text(name), justify="left" if place < 2 else "right", overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    left_out = ", ".join(name for name in cells.head if name not in head)
    below = [Text(f"(wider terminals show {left_out})", style="dim")] if left_out else []
    above = [Text(title, style="italic")] if title else []
    return Group(*above, table, *below)


def _width(head: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    """Characters that the table takes on one line a row."""
    return sum(max(cell_len(cell) for cell in column) + 2 for column in zip(head, *rows, strict=True))
