"""Tables without lines, as every command prints them."""

from rich.table import Table

FOLDED = ("metrics", "finished stages")
"""Columns whose text may go on in the next line."""


def plain_table(*columns: str) -> Table:
    """An empty table with these columns."""
    table = Table(box=None, padding=(0, 1))
    for name in columns:
        table.add_column(name, no_wrap=name not in FOLDED, overflow="fold")
    return table
