"""The folder tree of all runs, and checks that it can be written before work begins."""

import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel

from iowbc.errors import RecipeError, UsageError
from iowbc.recipe.reading.document import plain, read_document

Model = TypeVar("Model", bound=BaseModel)


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
        """Journals of tracking data until MLflow has received them."""
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
        self.option = [] if root == Path("runs") else ["--runs", str(root)]
        """Words of a command that select this folder; none for the default."""


def read_record(kind: type[Model], path: Path) -> Model | None:
    """The record in a JSON file; None where it is missing, being written, or damaged."""
    try:
        return kind.model_validate_json(path.read_bytes())
    except (OSError, ValueError):
        return None


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


def require_writable_runs(runs: Runs, *parts: Path) -> None:
    """Make the folder of runs where it is missing. Raises `UsageError` where it cannot be written, or one of its
    `parts`, by default all that a run writes."""
    usual = (runs.store, *runs.store.glob("*"), runs.work, runs.damaged, runs.locks, runs.recipes, runs.tracking)
    parts = parts or usual
    require_writable(runs.root, "--runs", next(filter(None, map(_closed, parts)), ""))


def require_writable(folder: Path, option: str, closed: str = "") -> None:
    """Make a folder that an option names. Raises `UsageError` where it cannot be written, or a part of it is `closed`
    for a reason; the advice is chown for another user's runs, else another folder."""
    reason = obstacle(folder) or closed
    if not reason:
        return
    advice, user = f"give another folder with {option}", os.geteuid()
    if option == "--runs" and folder.is_dir() and (owner := folder.stat().st_uid) != user:
        advice = (
            f"it belongs to user {owner} and this is user {user}: on the machine that it lies on (not inside a "
            f"container) say `sudo chown -R {user} {folder.name}`, or {advice}"
        )
    raise UsageError(f"{folder} cannot be written: {reason}; {advice}")


def obstacle(folder: Path) -> str:
    """The reason why files cannot be created in a folder, empty if they can; creates the folder if it is missing."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".writable-"):
            return ""
    except FileExistsError:
        return f"{folder.resolve()} is not a folder"
    except OSError as error:
        return error.strerror or str(error)


def _closed(part: Path) -> str:
    """The reason why an existing part of the runs is closed to this user; empty where it is open or not there."""
    if os.path.lexists(part) and not part.is_dir():
        return f"{part.resolve()} is not a folder"
    open_ = not part.exists() or os.access(part, os.R_OK | os.W_OK | os.X_OK)
    return "" if open_ else f"{part} belongs to another user or is read-only"
