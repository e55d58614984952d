"""The artifact store: `runs/store/<stage>/<key>/`, and behind it `runs/published/`, copies that a clone has already."""

import os
import shutil
import time
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from iowbc.errors import Damaged, UsageError
from iowbc.files import OLD, move_folder, replace_folder, restore_folder, synchronise
from iowbc.pipeline.store.artifact import BESIDE, MANIFEST, Artifact, read_artifact, write_manifest
from iowbc.pipeline.store.locks import lock_path, named_lock
from iowbc.pipeline.store.runs import Runs


class Store:
    """Artifacts by stage and key."""

    def __init__(self, runs: Runs) -> None:
        self.runs = runs

    def folder(self, stage: str, key: str) -> Path:
        """Folder of the artifact of a stage and key, whether or not it is there."""
        return self.runs.store / stage / key

    def find(self, stage: str, key: str, *, published: bool = False) -> Artifact | None:
        """The artifact that was made here, or the published one, or None. Raises `Damaged` where its manifest is not
        what was written."""
        folder = (self.runs.published if published else self.runs.store) / stage / key
        return read_artifact(folder, stage, key, published=published) if folder.is_dir() else None

    def checked(self, stage: str, key: str, *, published: bool = False) -> tuple[Artifact | None, str]:
        """The artifact that `find` finds and whose files are what was written, or what is wrong with it."""
        try:
            if (artifact := self.find(stage, key, published=published)) is not None:
                artifact.verify()
        except Damaged as error:
            return None, str(error)
        return artifact, ""

    def find_any(self, stage: str, key: str) -> Artifact | None:
        """The artifact that was made here, else the published one; None where there is none with a whole manifest."""
        for published in (False, True):
            with suppress(Damaged):
                if (artifact := self.find(stage, key, published=published)) is not None:
                    return artifact
        return None

    def artifacts(self, stage: str | None = None) -> list[Artifact]:
        """All readable artifacts, of one stage or of all, oldest first; of two with one key the one made here."""
        found: dict[str, Artifact] = {}
        for root in (self.runs.store, self.runs.published):
            for folder in root.glob(f"{stage or '*'}/*"):
                artifact = self.find_any(folder.parent.name, folder.name)
                if artifact is not None:
                    found[artifact.manifest.key] = artifact
        return sorted(found.values(), key=lambda artifact: artifact.manifest.made)

    def add(self, out: Path, stage: str, key: str) -> Artifact:
        """Move sealed output into the store, in place of an artifact that stands there already."""
        folder = self.folder(stage, key)
        folder.parent.mkdir(parents=True, exist_ok=True)
        replace_folder(out, folder)
        artifact = self.find(stage, key)
        assert artifact is not None
        return artifact

    def set_aside(self, stage: str, key: str) -> Path:
        """Move a damaged artifact out of the store; returns where it lies now."""
        stamp = time.strftime("%Y%m%d-%H%M%S")
        target = self.runs.damaged / f"{stage}-{key[:12]}-{stamp}-{os.getpid()}"
        target.parent.mkdir(parents=True, exist_ok=True)
        move_folder(self.folder(stage, key), target)
        return target


PUBLISHING = "publish"
"""Lock of whoever publishes."""
KINDS = frozenset(
    [".safetensors", ".json", ".jsonl", ".npz", ".parquet", ".onnx", ".csv", ".md", ".tex", ".png", ".xml", ".yaml"]
)
"""Endings of files that are published: reading them executes no code."""
LARGEST_FILE = 12_000_000
"""A larger file is left out [bytes]: the stages behind it need its digest alone. What a training goes on from fits."""
LARGEST_REPOSITORY = 60_000_000
"""All that may be published [bytes]: a clone must stay quick."""


def publish(runs: Runs, artifact: Artifact, without: Collection[str] = ()) -> Artifact:
    """Copy an artifact to `runs/published/` and verify the copy; one process at a time.

    Files of other kinds, large ones, and those named in `without` are left out and named in the copy's manifest. What a
    process left that died here is brought back or removed.
    """
    with named_lock(lock_path(runs, PUBLISHING)):
        for leftover in runs.published.glob("*/.*"):
            restore_folder(leftover) if leftover.suffix == OLD else shutil.rmtree(leftover)
        made = artifact.manifest
        target = runs.published / made.stage / made.key
        unfinished = target.with_name(f".{made.key}.new")
        omitted = tuple(
            name
            for name, record in made.files.items()
            if name in made.omitted or name in without or record.size > LARGEST_FILE or Path(name).suffix not in KINDS
        )
        for name in (*made.files, *BESIDE):
            if name not in omitted:
                (unfinished / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(artifact.folder / name, unfinished / name)
                synchronise(unfinished / name)
        write_manifest(unfinished, made.model_copy(update={"omitted": omitted}))
        replace_folder(unfinished, target)
        copy = read_artifact(target, made.stage, made.key, published=True)
        copy.verify()
        return copy


def published_size(runs: Runs) -> int:
    """Bytes of all that is published. Raises `UsageError` where that is more than a repository should carry."""
    size = sum(path.stat().st_size for path in runs.published.rglob("*") if path.is_file())
    if size > LARGEST_REPOSITORY:
        raise UsageError(
            f"{runs.published} has {size / 1e6:.0f} MB, more than the {LARGEST_REPOSITORY / 1e6:.0f} MB that a "
            f"repository should carry; remove what is out of date ({MANIFEST} in each folder says what it is)"
        )
    return size
