"""Folders of everything that runs leave behind."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from iowbc.errors import RecipeError
from iowbc.recipe.reading.document import plain, read_document


class Runs:
    """The folder `runs/` and its parts."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.store = root / "store"
        """Finished artifacts, `<stage>/<key>/`."""
        self.published = root / "published"
        """Artifacts that came with the repository, `<stage>/<key>/`; only `iowbc publish` writes there."""
        self.work = root / "work"
        """Scratch and checkpoints of stages that are not finished, `<key>/`."""
        self.damaged = root / "damaged"
        """Artifacts that were found damaged and set aside."""
        self.locks = root / "locks"
        """One lock file a key, with its holder's name in it."""
        self.recipes = root / "recipes"
        """Artifacts that each recipe used last, `<name>.json`."""
        self.tracking = root / "tracking"
        """Journals of what MLflow is to record, until it has taken it."""
        self.sweeps = root / "sweeps"
        """Points and results of each sweep, `<name>/`."""
        self.compared = root / "compare"
        """Tables, figures and films over several runs; those of a study in `<name>/`."""
        self.reports = root / "report"
        """HTML pages about runs."""
        self.npm = root / "npm"
        """Packages that npm fetched for web pages, a folder for each set of versions."""
        self.tracked_files = root / "mlartifacts"
        """Files of MLflow's runs, where it uses the embedded database."""
        self.parts = tuple(path for path in vars(self).values() if path != root)
        """All of these folders."""
        self.database = root / "mlflow.db"
        """MLflow's embedded database."""


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file; empty where it is missing, no regular file, not JSON, or holds something else."""
    return _read(path, json.loads)


def read_yaml(path: Path) -> dict[str, Any]:
    """The mapping in a YAML file as `read_json` has it; empty also where it is nested too deep for YAML's parser."""
    return _read(path, lambda text: plain(read_document(text, path.name)))


def _read(path: Path, parsed: Callable[[str], Any]) -> dict[str, Any]:
    try:
        found = parsed(path.read_text(encoding="utf-8")) if path.is_file() else {}
    except (OSError, ValueError, RecursionError, RecipeError):
        return {}
    return found if isinstance(found, dict) else {}
