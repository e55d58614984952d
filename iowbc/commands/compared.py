"""Which runs a folder of `runs/compare/` compares, kept so that other commands know them by its name."""

import json
from collections.abc import Sequence
from pathlib import Path

from iowbc.files import write_whole
from iowbc.pipeline.store.runs import Runs, read_json

RECORD = "runs.json"
"""File of a comparison with its runs."""
FILM = "side_by_side.mp4"
"""Its film of one trial."""


def record(words: Sequence[str], folder: Path) -> None:
    """Keep what the runs are called, in the folder of their comparison."""
    write_whole(folder / RECORD, json.dumps({"runs": list(words)}, indent=1))


def recorded(folder: Path) -> list[str]:
    """The runs that a folder compares; none where it is no comparison."""
    found = read_json(folder / RECORD)
    words = found.get("runs") if isinstance(found, dict) else None
    return [word for word in words if isinstance(word, str)] if isinstance(words, list) else []


def film_of(runs: Runs, words: Sequence[str]) -> Path | None:
    """The film of a comparison of the same runs, if one was made."""
    films = [runs.compared / FILM, *sorted(runs.compared.glob(f"*/{FILM}"))]
    return next((path for path in films if path.is_file() and sorted(recorded(path.parent)) == sorted(words)), None)
