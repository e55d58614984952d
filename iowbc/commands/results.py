"""What is worth seeing at the end of a run: metrics, result tables, and where figures, films and the export lie."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from rich.console import Console

from iowbc.pipeline.store.artifact import Artifact

SEEN_FOLDERS = ("figures", "videos")
"""Folders whose files are listed; tables are printed."""
EXPORTED = "policy.onnx"


def print_results(artifacts: Mapping[str, Artifact], console: Console) -> None:
    """Print the results of finished stages."""
    for name, artifact in artifacts.items():
        if artifact.metrics:
            values = ", ".join(f"{metric} {value:.4g}" for metric, value in artifact.metrics.items())
            _line(console, f"{name}: {values}")
    for artifact in artifacts.values():
        for table in sorted((artifact.folder / "tables").glob("*.md")):
            _line(console, "")
            _line(console, table.read_text(encoding="utf-8").rstrip())
    _line(console, "")
    for name, artifact in artifacts.items():
        for path in shown_files(artifact):
            _line(console, f"{name}: {path}")
    if artifacts:
        _line(console, "all artifacts: " + shown_path(next(iter(artifacts.values())).folder.parents[1]))


def shown_files(artifact: Artifact) -> Iterator[str]:
    """Figures and films of an artifact, and the exported graph."""
    for folder in SEEN_FOLDERS:
        for path in sorted((artifact.folder / folder).glob("*")):
            yield shown_path(path)
    if (artifact.folder / EXPORTED).is_file():
        yield shown_path(artifact.folder / EXPORTED)


def metrics_text(artifact: Artifact, limit: int | None = None) -> str:
    """The metrics of an artifact in one line, or the first few."""
    items = list(artifact.metrics.items())
    text = ", ".join(f"{name} {value:.4g}" for name, value in items[:limit])
    return text + (", ..." if limit is not None and len(items) > limit else "")


def shown_path(path: Path) -> str:
    """A path as short as it can be said from here."""
    relative = os.path.relpath(path)
    return relative if not relative.startswith("..") else str(path)


def _line(console: Console, text: str) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)
