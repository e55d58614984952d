"""The colours of figures, and a figure as a file."""

from pathlib import Path

from matplotlib.figure import Figure

DPI = 150
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Okabe and Ito's palette, distinguishable with any colour vision."""


def write_figure(figure: Figure, path: Path) -> None:
    """Save as PNG without the program's version in it, so that equal runs give equal files; makes the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
