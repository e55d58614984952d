"""A table of results, written as Markdown, LaTeX, CSV and JSON, and drawn on a terminal of any width."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field, TypeAdapter
from pydantic.dataclasses import dataclass
from rich.cells import cell_len
from rich.console import Group
from rich.table import Table as Drawing
from rich.text import Text

if TYPE_CHECKING:
    import pandas as pd

FAILS = "Fails"
ABSENT = "–"
LATEX_ESCAPES = str.maketrans(
    {sign: f"\\{sign}" for sign in "%_&#${}"}
    | {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"}
)
LATEX_SIGNS = str.maketrans(
    {"±": r"$\pm$", "–": "--", "≥": r"$\geq$", "μ": r"$\mu$", "·": r"$\cdot$", "Δ": r"$\Delta$", "<": "$<$"}
)
NARROWEST = 20
"""Minimum width of a wrapped name [characters]."""
NAMES = 1
"""Index of the column whose names may wrap."""


@dataclass(frozen=True)
class Column:
    """The head of a column."""

    name: str
    unit: str = ""
    latex: str = ""
    """Heading in LaTeX, if different."""
    role: Literal["own", "paper", "detail"] = "own"
    """`paper`: the paper's values; `detail`: nearly redundant. Narrow terminals leave both out first."""

    @property
    def head(self) -> str:
        return f"{self.name} [{self.unit}]" if self.unit else self.name


@dataclass(frozen=True)
class MeanCell:
    """A mean with half its interval, and a note behind it; narrow terminals leave the interval out."""

    value: str
    half: str
    note: str = ""

    def __str__(self) -> str:
        return f"{self.value} ± {self.half}{self.note}"


Cell = str | MeanCell


@dataclass(frozen=True)
class Table:
    """A table of finished cells."""

    name: str
    caption: str
    columns: tuple[Column, ...]
    rows: Sequence[tuple[Cell, ...]]
    numbers: Any = Field(default=None, exclude=True, repr=False)
    """The same figures as numbers, a pandas DataFrame, for the CSV."""
    grouped: bool = True
    """True if rows with the same first column form a group."""

    @property
    def head(self) -> tuple[str, ...]:
        return tuple(column.head for column in self.columns)

    def texts(self, intervals: bool = True) -> list[list[str]]:
        """The cells as text, with or without intervals; a group's name appears only in its first row."""
        found = [
            [cell if isinstance(cell, str) else str(cell) if intervals else cell.value + cell.note for cell in row]
            for row in self.rows
        ]
        group = ""
        for row in found if self.grouped else ():
            row[0], group = "" if row[0] == group else row[0], row[0]
        return found


STORED = TypeAdapter(Table)


def heads(*names: str | Column) -> tuple[Column, ...]:
    """Columns; one that has only a name may be given as text."""
    return tuple(Column(name) if isinstance(name, str) else name for name in names)


def measured(
    value: float, half: float = np.nan, form: str = ".3f", half_form: str = ".3f", note: str = "", none: str = ABSENT
) -> Cell:
    """A cell with a mean and half its interval; only the mean if `half` is NaN, `none` if the mean is NaN."""
    if np.isnan(value):
        return none
    return MeanCell(f"{value:{form}}", f"{half:{half_form}}", note) if np.isfinite(half) else f"{value:{form}}"


def markdown(table: Table) -> str:
    """GitHub Markdown with the caption above."""
    caption = [f"*{table.caption}*", ""] if table.caption else []
    texts = [[cell.replace("|", r"\|") for cell in row] for row in (table.head, *table.texts())]
    rows = [texts[0], ["---"] * len(table.head), *texts[1:]]
    return "\n".join([*caption, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def latex(table: Table) -> str:
    """A table with the paper's row groups, no wider than the text; needs booktabs, multirow and adjustbox."""
    import pandas as pd

    head = [column.latex or column.head for column in table.columns]
    frame = pd.DataFrame([[str(cell) for cell in row] for row in table.rows], columns=head)
    style = frame.set_index(head[:2]).style.format_index(escape="latex") if table.grouped else frame.style.hide()
    style = style.format(escape="latex").format_index(escape="latex-math", axis="columns")
    text = style.to_latex(
        caption=table.caption.translate(LATEX_ESCAPES),
        label=f"tab:{table.name}",
        position="h",
        position_float="centering",
        hrules=True,
        clines="skip-last;data" if table.grouped else None,
        multirow_align="c",
        column_format="ll" + "c" * (len(head) - 2),
    )
    fitted = str(text).replace(r"\begin{tabular}", "\\begin{adjustbox}{max width=\\textwidth}\n\\begin{tabular}")
    return fitted.replace(r"\end{tabular}", "\\end{tabular}\n\\end{adjustbox}").translate(LATEX_SIGNS)


def write_table(table: Table, folder: Path) -> None:
    """Write `<name>.md`, `<name>.tex`, `<name>.csv`, and `<name>.json`, which `read_tables` reads."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{table.name}.md").write_text(markdown(table), encoding="utf-8")
    (folder / f"{table.name}.tex").write_text(latex(table), encoding="utf-8")
    (folder / f"{table.name}.json").write_bytes(STORED.dump_json(table))
    table.numbers.to_csv(folder / f"{table.name}.csv", index=False)


def write_frame(frame: "pd.DataFrame", path: Path) -> None:
    """Write a table without its index; floats split by bytes, which makes trials smaller by a third."""
    floats = [name for name in frame.columns if frame[name].dtype.kind == "f"]
    others = [name for name in frame.columns if name not in floats]
    frame.to_parquet(
        path,
        index=False,
        compression="zstd",
        compression_level=19,
        use_byte_stream_split=floats,
        use_dictionary=others,
    )


def read_tables(folder: Path) -> list[Table]:
    """The tables that were written into a folder, by name."""
    return [STORED.validate_json(path.read_bytes()) for path in sorted(folder.glob("*.json"))]


def drawn(table: Table, width: int) -> Group:
    """A table for a terminal of `width` characters, below the first words of its caption. Names in the second column
    wrap; then these are left out in order: the paper's values, intervals, detail columns, others from the right."""
    shown, rows = list(range(len(table.columns))), table.texts()

    def fits() -> bool:
        """True if every cell fits on one line, except for names."""
        found = [max(map(cell_len, [table.head[place], *(row[place] for row in rows)])) for place in shown]
        found[NAMES:2] = [min(name, NARROWEST) for name in found[NAMES:2]]
        return sum(found) + 2 * len(found) <= width

    if not fits():
        shown = [place for place in shown if table.columns[place].role != "paper"]
    if not fits():
        rows = table.texts(intervals=False)
    while len(shown) > 2 and not fits():
        shown.remove(next((p for p in reversed(shown) if table.columns[p].role == "detail"), shown[-1]))
    drawing = Drawing(box=None, padding=(0, 2, 0, 0), header_style="bold")
    for number, place in enumerate(shown):
        justify: Literal["left", "right"] = "left" if number < 2 else "right"
        drawing.add_column(Text(table.head[place]), justify=justify, overflow="fold", no_wrap=number != NAMES)
    for row in rows:
        drawing.add_row(*(Text(row[place]) for place in shown))
    title = re.split(r"[:.](?: |$)", table.caption, maxsplit=1)[0]
    left_out = ", ".join(name for place, name in enumerate(table.head) if place not in shown)
    below = [Text(f"(wider terminals show {left_out})", style="dim")] if left_out else []
    return Group(*([Text(title, style="italic")] if title else []), drawing, *below)
