"""`iowbc gc`: removal of what was asked for by name, and of nothing that a process works on."""

import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from iowbc.commands.lookup import known_recipes, last_used
from iowbc.commands.printed import shown_path, tell
from iowbc.errors import UsageError, nearest
from iowbc.files import OLD
from iowbc.pipeline.console.wording import size
from iowbc.pipeline.store.last_used import ever_used, record_path, remove_dangling
from iowbc.pipeline.store.locks import holder
from iowbc.pipeline.store.publishing import PUBLISHING
from iowbc.pipeline.store.store import Store
from iowbc.pipeline.store.workspace import unfinished
from iowbc.pipeline.tracking.journal import Journal, sent_path, unsent
from iowbc.pipeline.writability import require_writable_runs

REMOVING = ".removing-"
"""Beginning of the name of a folder that is being removed."""
DAY = 86_400.0
"""Seconds."""
PRECIOUS = 3600.0
"""A stage that took longer [s] is removed by its recipe's name alone."""


@dataclass(frozen=True)
class Scope:
    """Scope of a removal."""

    unused: bool = False
    """Artifacts that no recipe ever used, and remains of processes that died; with `older_than` also those that none
    used lately."""
    recipes: tuple[str, ...] = ()
    """These recipes' records, and artifacts that they used and no other recipe did."""
    work: bool = False
    """Scratch and checkpoints of stages that did not finish, and journals of their runs that MLflow has."""
    damaged: bool = False
    """Artifacts that were set aside as damaged."""
    older_than: float = 0.0
    """Of all these only what is older [days], and of artifacts in use before what has not been used for as long."""


def collect(store: Store, console: Console, scope: Scope, dry_run: bool) -> None:
    """Remove what the scope names, or list it. Raises `UsageError` without a scope."""
    if not (scope.unused or scope.recipes or scope.work or scope.damaged):
        raise UsageError(
            "gc removes only what it is told to: --unused (artifacts that no recipe ever used), --recipe NAME, "
            "--work (unfinished stages), --damaged; --older-than DAYS narrows it, --dry-run only lists"
        )
    if store.runs.root.exists() and not dry_run:
        require_writable_runs(store.runs)
    total = 0
    for path in dict.fromkeys(_doomed(store, scope)):
        if time.time() - path.stat().st_mtime < scope.older_than * DAY:
            continue
        count = sum(file.stat().st_size for file in (path, *path.rglob("*")) if file.is_file())
        total += count
        verb = "would remove" if dry_run else "removed"
        if not dry_run:
            _remove(path)
        tell(console, f"{verb} {shown_path(path)} ({size(count)})")
    if not dry_run:
        remove_dangling(store.runs)
    console.print(f"{size(total)} in all", highlight=False)


def _doomed(store: Store, scope: Scope) -> Iterator[Path]:
    runs, recipes = store.runs, known_recipes(store)
    for recipe in scope.recipes:
        if recipe not in recipes:
            listing = ", ".join(recipes) or "none"
            text = f"no such recipe has run; those that have: {listing}{nearest(recipe, recipes)}"
            raise UsageError(f"--recipe {recipe}: {text}")
    own = [artifact for artifact in store.artifacts() if not artifact.published]
    free = [artifact for artifact in own if not holder(runs, artifact.manifest.key)]
    if scope.unused:
        last = {artifact.manifest.key for name in recipes for artifact in last_used(store, name).values()}
        limit = time.time() - scope.older_than * DAY if scope.older_than else 0.0
        spared = last | {key for name in recipes for key, used in ever_used(runs, name).items() if used >= limit}
        for artifact in free:
            if artifact.manifest.key not in spared and artifact.manifest.seconds < PRECIOUS:
                yield artifact.folder
        for path in (*runs.store.glob("*/.*"), *runs.published.glob("*/.*")):
            key = path.name.split(".")[1]
            restorable = path.suffix == OLD and not path.with_name(key).exists()
            if not restorable and not holder(runs, key) and not holder(runs, PUBLISHING):
                yield path
    others = {key for name in recipes if name not in scope.recipes for key in ever_used(runs, name)}
    for recipe in scope.recipes:
        keys = ever_used(runs, recipe).keys() - others
        yield from (artifact.folder for artifact in free if artifact.manifest.key in keys)
        yield record_path(runs, recipe)
    if scope.work:
        yield from (folder for folder, _ in unfinished(runs) if not holder(runs, folder.name))
        for path in runs.tracking.glob("*.jsonl"):
            with Journal(path) as journal:
                if journal.acquire() and not unsent(path):
                    yield path
                    yield sent_path(path)
    if scope.damaged:
        yield from runs.damaged.glob("*")


def _remove(path: Path) -> None:
    """A folder disappears from its place at once, then its files."""
    if path.is_dir():
        doomed = path.with_name(REMOVING + path.name.removeprefix(REMOVING))
        path.rename(doomed)
        shutil.rmtree(doomed)
    else:
        path.unlink()
