"""`iowbc gc`: removes what its options select, but nothing that a process is using."""

import shutil
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import closing, nullcontext, suppress
from pathlib import Path
from secrets import token_hex
from typing import Annotated, Any

from rich.filesize import decimal
from typer import Option

from iowbc.commands import options
from iowbc.commands.lookup import known_recipes, last_used
from iowbc.commands.printed import shown_path, stdout_console, tell
from iowbc.errors import UsageError, require_known
from iowbc.files import OLD
from iowbc.pipeline.store.artifact import INGREDIENTS, Artifact
from iowbc.pipeline.store.last_used import ever_used, record_path, remove_dangling
from iowbc.pipeline.store.locks import holder, lock_path, named_lock
from iowbc.pipeline.store.runs import Runs, read_json, require_writable_runs
from iowbc.pipeline.store.store import PUBLISHING, Store
from iowbc.pipeline.store.workspace import unfinished
from iowbc.pipeline.tracking.journal import Journal, sent_path, unsent
from iowbc.stages.registry import STAGES

REMOVING = ".removing-"
"""Beginning of the name of a folder that is being removed."""
DAY = 86_400.0
"""Length of a day [s]."""
LONG_STAGE = 3600.0
"""A stage that took longer [s] is removed by its recipe's name alone."""


def gc(
    unused: Annotated[bool, Option("--unused", help="Remove artifacts that no recipe ever used.")] = False,
    recipes: Annotated[
        list[str] | None,
        Option("--recipe", help="Remove this recipe's record and the artifacts that only it uses."),
    ] = None,
    work: Annotated[bool, Option("--work", help="Remove checkpoints of unfinished stages.")] = False,
    damaged: Annotated[bool, Option("--damaged", help="Remove artifacts set aside as damaged.")] = False,
    older_than: Annotated[float, Option(help="Minimum age of removed items.", min=0.0, metavar="DAYS")] = 0.0,
    dry_run: Annotated[bool, Option("--dry-run", help="List the removals without removing anything.")] = False,
    runs: options.RunsFolder = options.RUNS,
) -> None:
    """Remove what the options select, or list it. Raises `UsageError` if they select nothing.

    unused: also leftovers of processes that died; with `older_than` [days] also artifacts not used for as long. work:
    also scratch files, and fully sent journals of dead processes.
    """
    if not (unused or recipes or work or damaged):
        raise UsageError(
            "gc removes only what its options select: --unused (artifacts that no recipe ever used), --recipe NAME, "
            "--work (unfinished stages), --damaged; --older-than DAYS narrows it, --dry-run only lists"
        )
    store, console = Store(Runs(runs)), stdout_console()
    total, alone = 0, store.runs.root.exists() and not dry_run
    if alone:
        require_writable_runs(store.runs)
    with named_lock(lock_path(store.runs, "gc")) if alone else nullcontext():
        for path in dict.fromkeys(_to_remove(store, unused, recipes or (), work, damaged, older_than)):
            if not path.exists() or holder(store.runs, path.name):
                continue  # removed or begun since it was listed
            if older_than and time.time() - path.stat().st_mtime < older_than * DAY:
                continue
            count = sum(file.stat().st_size for file in (path, *path.rglob("*")) if file.is_file())
            total += count
            verb = "would remove" if dry_run else "removed"
            if path.is_dir() and not dry_run:
                doomed = path.with_name(REMOVING + token_hex(8))
                path.rename(doomed)  # it disappears from its place at once, then its files
                shutil.rmtree(doomed)
            elif not dry_run:
                path.unlink()
            tell(console, f"{verb} {shown_path(path)} ({decimal(count)})")
        if not dry_run:
            remove_dangling(store.runs)
    console.print(f"{decimal(total)} in all", highlight=False)


def _to_remove(
    store: Store, unused: bool, recipes: Sequence[str], work: bool, damaged: bool, older_than: float
) -> Iterator[Path]:
    runs, known = store.runs, known_recipes(store)
    for recipe in recipes:
        require_known(recipe, "recipe that has run", known)
    own = [artifact for artifact in store.artifacts() if not artifact.published]
    kept = [folder for folder, _ in unfinished(runs) if not work or holder(runs, folder.name)]
    attempts = [read_json(folder / INGREDIENTS) for folder in kept]
    free = [
        one for one in own if not holder(runs, one.manifest.key) and not any(_reads(each, one) for each in attempts)
    ]
    if unused:
        last = {artifact.manifest.key for name in known for artifact in last_used(store, name).values()}
        limit = time.time() - older_than * DAY if older_than else 0.0
        spared = last | {key for name in known for key, used in ever_used(runs, name).items() if used >= limit}
        spared |= _lent(own, spared)
        for artifact in free:
            if artifact.manifest.key not in spared and artifact.manifest.seconds < LONG_STAGE:
                yield artifact.folder
        for path in (*runs.store.glob("*/.*"), *runs.published.glob("*/.*")):
            key = path.name.split(".")[1]
            restorable = path.suffix == OLD and not path.with_name(key).exists()
            if not restorable and not holder(runs, key) and not holder(runs, PUBLISHING):
                yield path
    if recipes:
        others = {key for name in known if name not in recipes for key in ever_used(runs, name)}
        others |= _lent(own, others)
    for recipe in recipes:
        with suppress(UsageError):  # of a damaged record, which goes alone
            keys = ever_used(runs, recipe).keys() - others
            yield from [artifact.folder for artifact in free if artifact.manifest.key in keys]
        yield record_path(runs, recipe)
    if work:
        yield from (folder for folder, _ in unfinished(runs) if not holder(runs, folder.name))
        yield from runs.work.glob(f"{REMOVING}*")
        for path in runs.tracking.glob("*.jsonl"):
            with closing(Journal(path)) as journal:
                if journal.acquire() and not unsent(path):
                    yield from (one for one in (path, sent_path(path)) if one.exists())
    if damaged:
        yield from runs.damaged.glob("*")


def _reads(attempt: Mapping[str, Any], artifact: Artifact) -> bool:
    """True if an attempt with these ingredients reads an artifact, from its own recipe or from that of another one."""
    stage, digest = artifact.manifest.stage, artifact.manifest.digest
    return attempt.get("inputs", {}).get(stage) == digest or digest in _borrowed(attempt)


def _lent(own: Sequence[Artifact], keys: Collection[str]) -> set[str]:
    """Keys of the artifacts that those with `keys` borrow from other recipes."""
    borrowed = {digest for one in own if one.manifest.key in keys for digest in _borrowed(one.ingredients)}
    return {one.manifest.key for one in own if one.manifest.digest in borrowed}


def _borrowed(ingredients: Mapping[str, Any]) -> set[str]:
    """Digests of the inputs that other recipes made."""
    return {digest for name, digest in ingredients.get("inputs", {}).items() if name not in STAGES}
