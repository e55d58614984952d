"""Markdown tables of results, drawn on a terminal of any width."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from rich.cells import cell_len
from rich.console import Group
from rich.table import Table
from rich.text import Text

from iowbc.commands.tables import NARROWEST, folded

INTERVAL = re.compile(r" ± [\d.]+(?:e[-+]\d+)?")
"""Half an interval behind a mean."""
PAPER = "paper "
"""What the head of a column begins with that holds the paper's own figure."""
NAMES = 1
"""The column that may go on in the next line."""


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

    Numbers stay whole; the names in the second column are folded. What does not fit even so goes in this order: the
    paper's figures, the intervals, columns from the right, of which those with a column of differences go first.
    """
    title = re.split(r"[:.](?: |$)", cells.caption, maxsplit=1)[0]
    head, rows = cells.head, cells.rows
    if _least_width(head, rows) > width:
        own = [place for place, name in enumerate(head) if not name.startswith(PAPER)]
        head, rows = tuple(head[place] for place in own), tuple(tuple(row[place] for place in own) for row in rows)
    if _least_width(head, rows) > width:
        rows = tuple(tuple(INTERVAL.sub("", cell) for cell in row) for row in rows)
    while len(head) > 2 and _least_width(head, rows) > width:
        place = next((place for place in reversed(range(len(head))) if f"Δ {head[place]}" in head), len(head) - 1)
        head, rows = _without(head, place), tuple(_without(row, place) for row in rows)
    names = NARROWEST + max(_spare(head, rows) - max(_width(head, rows) - width, 0), 0)
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for place, name in enumerate(head):
        table.add_column(Text(name), justify="left" if place < 2 else "right", overflow="fold")
    for row in rows:
        table.add_row(*(Text(folded(cell, names) if place == NAMES else cell) for place, cell in enumerate(row)))
    left_out = ", ".join(name for name in cells.head if name not in head)
    below = [Text(f"(wider terminals show {left_out})", style="dim")] if left_out else []
    above = [Text(title, style="italic")] if title else []
    return Group(*above, table, *below)


def _without(cells: tuple[str, ...], place: int) -> tuple[str, ...]:
    return cells[:place] + cells[place + 1 :]


def _widths(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[int]:
    """Characters of each column on one line a row."""
    return [max(map(cell_len, column)) for column in zip(head, *rows, strict=True)]


def _width(head: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    """Characters that the table takes on one line a row."""
    return sum(width + 2 for width in _widths(head, rows))


def _least_width(head: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    """The same with its names folded."""
    return _width(head, rows) - _spare(head, rows)


def _spare(head: Sequence[str], rows: Sequence[Sequence[str]]) -> int:
    """Characters by which its names can be folded."""
    return max([0, *(width - NARROWEST for width in _widths(head, rows)[NAMES : NAMES + 1])])
