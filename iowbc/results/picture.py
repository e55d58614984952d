"""A figure as a file."""

from pathlib import Path

from matplotlib.figure import Figure

DPI = 150


def write_figure(figure: Figure, path: Path) -> None:
    """Save as PNG without the program's version in it, so that equal runs give equal files; makes the folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI, metadata={"Software": None})
