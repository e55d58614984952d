"""Checks before work begins that folders can be written."""

import os
import tempfile
from pathlib import Path

from iowbc.errors import UsageError
from iowbc.pipeline.store.runs import Runs


def require_writable_runs(runs: Runs) -> None:
    """Make the folder of runs where it is missing. Raises `UsageError` where it, or a part of it, cannot be written."""
    parts = (runs.store, *runs.store.glob("*"), runs.work, runs.damaged, runs.locks, runs.recipes, runs.tracking)
    reason = obstacle(runs.root) or next(filter(None, map(_closed, parts)), "")
    if reason:
        raise UsageError(f"{runs.root} cannot be written: {reason}; {_remedy(runs.root, '--runs')}")


def require_writable(folder: Path, option: str) -> None:
    """Make a folder that an option names. Raises `UsageError` where it cannot be written."""
    reason = obstacle(folder)
    if reason:
        raise UsageError(f"{folder} cannot be written: {reason}; {_remedy(folder, option)}")


def _remedy(folder: Path, option: str) -> str:
    """Remedy for a folder that cannot be written: another user's runs are to be given to this one; any other
    folder is left to its owner."""
    there = next((path for path in (folder, *folder.parents) if path.exists()), folder)
    owner, user = there.stat().st_uid, os.geteuid()
    if option != "--runs" or owner == user or there != folder or not folder.is_dir():
        return f"give another folder with {option}"
    return (
        f"it belongs to user {owner} and this is user {user}: on the machine that it lies on (not inside a container) "
        f"say `sudo chown -R {user} {folder.name}`, or give another folder with {option}"
    )


def obstacle(folder: Path) -> str:
    """The reason why no file can be made in a folder, which is made where it is missing; empty where one can."""
    if folder.exists() and not folder.is_dir():
        return "it is not a folder"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=folder, prefix=".writable-"):
            return ""
    except OSError as error:
        return error.strerror or str(error)


def _closed(part: Path) -> str:
    """The reason why an existing part of the runs is closed to this user; empty where it is open or not there."""
    if part.exists() and not part.is_dir():
        return f"{part} is not a folder"
    open_ = not part.exists() or os.access(part, os.R_OK | os.W_OK | os.X_OK)
    return "" if open_ else f"{part} belongs to another user or is read-only"
