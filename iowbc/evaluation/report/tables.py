"""What a table is, and its forms: Markdown, LaTeX and CSV."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

FAILS = "Fails"
ABSENT = "–"
LATEX_SIGNS = str.maketrans(
    {"±": r"$\pm$", "–": "--", "≥": r"$\geq$", "μ": r"$\mu$", "·": r"$\cdot$", "Δ": r"$\Delta$", "<": "$<$"}
)


@dataclass(frozen=True)
class Table:
    """A table of finished cells; the first column groups rows that repeat it."""

    name: str
    caption: str
    head: tuple[str, ...]
    latex_head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: pd.DataFrame
    """The same figures as numbers, for the CSV."""


def markdown(table: Table) -> str:
    """GitHub Markdown with the caption above; a repeated first column is printed once."""
    lines = [f"*{table.caption}*", "", _pipe(table.head), _pipe(["---"] * len(table.head))]
    previous = ""
    for row in table.rows:
        lines.append(_pipe(["" if row[0] == previous else row[0], *row[1:]]))
        previous = row[0]
    return "\n".join(lines) + "\n"


def latex(table: Table) -> str:
    """A booktabs table with the paper's row groups, no wider than the text; needs the packages booktabs, multirow and
    adjustbox."""
    grouped = table.head[1] == "Algorithm"
    frame = pd.DataFrame(table.rows, columns=list(table.latex_head))
    if grouped:
        style = frame.set_index(list(table.latex_head[:2])).style.format_index(escape="latex")
    else:
        style = frame.style.hide(axis="index")
    text = (
        style.format(escape="latex")
        .format_index(escape="latex-math", axis="columns")
        .to_latex(
            caption=table.caption.replace("%", r"\%").replace("_", r"\_"),
            label=f"tab:{table.name}",
            position="h",
            position_float="centering",
            hrules=True,
            clines="skip-last;data" if grouped else None,
            multirow_align="c",
            column_format="ll" + "c" * (len(table.head) - 2),
        )
    )
    fitted = str(text).replace(r"\begin{tabular}", "\\begin{adjustbox}{max width=\\textwidth}\n\\begin{tabular}")
    return fitted.replace(r"\end{tabular}", "\\end{tabular}\n\\end{adjustbox}").translate(LATEX_SIGNS)


def write_table(table: Table, folder: Path) -> None:
    """Write `<name>.md`, `<name>.tex` and `<name>.csv`."""
    (folder / f"{table.name}.md").write_text(markdown(table), encoding="utf-8")
    (folder / f"{table.name}.tex").write_text(latex(table), encoding="utf-8")
    table.numbers.to_csv(folder / f"{table.name}.csv", index=False)


def _pipe(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
