"""Tables in the paper's own form (II and III), beside its numbers, as Markdown, LaTeX and CSV."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd

from iowbc.evaluation.report.aggregate import load_capacity, variants_of
from iowbc.evaluation.report.paper import TYRE_SUCCESS, VARIANTS, reported
from iowbc.evaluation.trials.metrics import ERRORS

HEADS = {"E_alpha": "E_α [rad]", "E_h": "E_h [m]", "E_v": "E_v [m/s]", "E_psi": "E_ψ [rad]"}
LATEX_HEADS = {"E_alpha": r"$E_{\alpha}$", "E_h": "$E_{h}$", "E_v": "$E_{v}$", "E_psi": r"$E_{\psi}$"}
FAILS = "Fails"
ABSENT = "–"
TYRE_MASS = 18.0
LATEX_SIGNS = str.maketrans({"±": r"$\pm$", "–": "--"})
NO_LABELS: Mapping[str, str] = MappingProxyType({})


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


def sweep_table(summary: pd.DataFrame, suite: str, labels: Mapping[str, str] = NO_LABELS) -> Table:
    """Table II ("lifting") or III ("pushing"): errors by mass and variant, with survival, beside the paper's.

    labels: the paper's name of variants that go by another one here; where it knows none, its columns are left out.
    """
    chosen = summary[summary["suite"] == suite]
    rows = []
    with_paper = any(labels.get(str(variant), str(variant)) in VARIANTS for variant in chosen["variant"])
    for _, row in chosen.iterrows():
        mass, variant = float(row["mass"]), str(row["variant"])
        own = [_with_half(row[name], row[f"{name}_half"]) for name in ERRORS]
        paper = reported(suite, mass, labels.get(variant, variant))
        if not with_paper:
            theirs = []
        elif paper == "absent":
            theirs = [ABSENT] * len(ERRORS)
        else:
            theirs = [FAILS] * len(ERRORS) if paper is None else [f"{value:.3f}" for value in paper]
        rows.append((f"{mass:g} kg", variant, *own, f"{row['survived']}/{row['trials']}", *theirs))
    number = {"lifting": "II", "pushing": "III"}.get(suite, "")
    beside = "; right, what the paper reports for its own commands" if with_paper else ""
    return Table(
        name=suite,
        caption=f"Command tracking errors under cooperative {suite} (paper's Table {number}): means over surviving "
        f"trials with their 95 % interval{beside}.",
        head=(
            "Mass",
            "Algorithm",
            *HEADS.values(),
            "Survived",
            *(f"paper {head.split()[0]}" for head in HEADS.values() if with_paper),
        ),
        latex_head=(
            "Mass",
            "Algorithm",
            *LATEX_HEADS.values(),
            "Survived",
            *(f"paper {h}" for h in LATEX_HEADS.values() if with_paper),
        ),
        rows=tuple(rows),
        numbers=chosen,
    )


def success_table(summary: pd.DataFrame, labels: Mapping[str, str] = NO_LABELS) -> Table:
    """The heavy tasks: how many trials survived, with Wilson's interval, beside the paper's rate."""
    chosen = summary[summary["suite"] == "heavy"]
    rows = []
    for _, row in chosen.iterrows():
        mass, variant = float(row["mass"]), str(row["variant"])
        paper = TYRE_SUCCESS.get(labels.get(variant, variant)) if mass == TYRE_MASS else None
        rows.append(
            (
                f"{row['case']} ({mass:g} kg)",
                variant,
                f"{row['survived']}/{row['trials']}",
                f"{100 * row['rate']:.0f} %",
                f"{100 * row['rate_low']:.0f} to {100 * row['rate_high']:.0f} %",
                ABSENT if paper is None else f"{100 * paper:.0f} %",
            )
        )
    head = ("Task", "Algorithm", "Survived", "Rate", "95 % interval", "Paper")
    return Table("heavy", "Success in the heavy tasks.", head, head, tuple(rows), chosen)


def capacity_table(summary: pd.DataFrame, rate: float) -> Table:
    """The largest mass that each variant carries and pushes with the success rate asked for."""
    suites = [suite for suite in ("lifting", "pushing") if (summary["suite"] == suite).any()]
    numbers, rows = [], []
    for variant in variants_of(summary):
        capacities = [load_capacity(summary, suite, variant, rate) for suite in suites]
        played = [set(summary.loc[summary["suite"] == suite, "variant"]) for suite in suites]
        missing = [FAILS if variant in variants else ABSENT for variants in played]
        cells = [no if c is None else f"{c:g} kg" for c, no in zip(capacities, missing, strict=True)]
        rows.append((variant, *cells))
        numbers.append({"variant": variant, **dict(zip(suites, capacities, strict=True))})
    head = ("Algorithm", *(f"{suite.capitalize()} capacity" for suite in suites))
    caption = f"Load capacity: the largest mass up to which every mass reached {100 * rate:.0f} % success."
    return Table("capacity", caption, head, head, tuple(rows), pd.DataFrame(numbers))


def markdown(table: Table) -> str:
    """GitHub Markdown with the caption above; a repeated first column is printed once."""
    lines = [f"*{table.caption}*", "", _pipe(table.head), _pipe(["---"] * len(table.head))]
    previous = ""
    for row in table.rows:
        lines.append(_pipe(["" if row[0] == previous else row[0], *row[1:]]))
        previous = row[0]
    return "\n".join(lines) + "\n"


def latex(table: Table) -> str:
    """A booktabs table with the paper's row groups; needs the packages booktabs and multirow."""
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
            caption=table.caption.replace("%", r"\%"),
            label=f"tab:{table.name}",
            position="h",
            position_float="centering",
            hrules=True,
            clines="skip-last;data" if grouped else None,
            multirow_align="c",
            column_format="ll" + "c" * (len(table.head) - 2),
        )
    )
    return str(text).translate(LATEX_SIGNS)


def write_table(table: Table, folder: Path) -> None:
    """Write `<name>.md`, `<name>.tex` and `<name>.csv`."""
    (folder / f"{table.name}.md").write_text(markdown(table))
    (folder / f"{table.name}.tex").write_text(latex(table))
    table.numbers.to_csv(folder / f"{table.name}.csv", index=False)


def _with_half(value: float, half: float) -> str:
    if np.isnan(value):
        return FAILS
    return f"{value:.3f}" if np.isnan(half) else f"{value:.3f} ± {half:.3f}"


def _pipe(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
