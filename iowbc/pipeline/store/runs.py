"""Folders of everything that runs leave behind."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iowbc.errors import RecipeError
from iowbc.recipe.reading.document import plain, read_document


@dataclass(frozen=True)
class Runs:
    """The folder `runs/` and its parts."""

    root: Path

    @property
    def store(self) -> Path:
        """Finished artifacts, `<stage>/<key>/`."""
        return self.root / "store"

    @property
    def published(self) -> Path:
        """Artifacts that came with the repository, `<stage>/<key>/`; only `iowbc publish` writes there."""
        return self.root / "published"

    @property
    def work(self) -> Path:
        """Scratch and checkpoints of stages that are not finished, `<key>/`."""
        return self.root / "work"

    @property
    def damaged(self) -> Path:
        """Artifacts that were found damaged and set aside."""
        return self.root / "damaged"

    @property
    def locks(self) -> Path:
        """One lock file a key, with its holder's name in it."""
        return self.root / "locks"

    @property
    def recipes(self) -> Path:
        """Artifacts that each recipe used last, `<name>.json`."""
        return self.root / "recipes"

    @property
    def tracking(self) -> Path:
        """Journals of what MLflow is told, until it has taken it."""
        return self.root / "tracking"

    @property
    def parts(self) -> tuple[Path, ...]:
        """All of these folders."""
        return (
            self.store,
            self.published,
            self.work,
            self.damaged,
            self.locks,
            self.recipes,
            self.tracking,
            self.tracked_files,
            self.compared,
            self.reports,
            self.sweeps,
            self.npm,
        )

    @property
    def sweeps(self) -> Path:
        """Points and results of each sweep, `<name>/`."""
        return self.root / "sweeps"

    @property
    def compared(self) -> Path:
        """Tables, figures and films over several runs; those of a study in `<name>/`."""
        return self.root / "compare"

    @property
    def reports(self) -> Path:
        """HTML pages about runs."""
        return self.root / "report"

    @property
    def npm(self) -> Path:
        """Packages that npm fetched for web pages, a folder for each set of versions."""
        return self.root / "npm"

    @property
    def database(self) -> Path:
        """MLflow's embedded database."""
        return self.root / "mlflow.db"

    @property
    def tracked_files(self) -> Path:
        """Files of MLflow's runs, where it uses the embedded database."""
        return self.root / "mlartifacts"


def read_json(path: Path) -> Any:
    """The content of a JSON file, or None where it is missing, no regular file, or not JSON."""
    try:
        return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None
    except (OSError, ValueError, RecursionError):
        return None


def read_yaml(path: Path) -> Any:
    """The content of a YAML file as `read_json` has it, None also where it is nested too deep for YAML's parser."""
    try:
        return plain(read_document(path.read_text(encoding="utf-8"), path.name)) if path.is_file() else None
    except (OSError, ValueError, RecipeError):
        return None
