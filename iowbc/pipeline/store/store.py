"""The artifact store: `runs/store/<stage>/<key>/`, and behind it `runs/published/`, which came with the repository:
copies of small files of safe types."""

import os
import shutil
import time
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from iowbc.errors import Damaged
from iowbc.files import OLD, move_folder, replace_folder, restore_folder, synchronise
from iowbc.pipeline.store.artifact import BESIDE, Artifact, read_artifact, write_manifest
from iowbc.pipeline.store.locks import lock_path, named_lock
from iowbc.pipeline.store.runs import Runs

PUBLISHING = "publish"
"""Name of the lock of publishing."""
KINDS = frozenset(
    [".safetensors", ".json", ".jsonl", ".npz", ".parquet", ".onnx", ".csv", ".md", ".tex", ".png", ".xml", ".yaml"]
)
"""Endings of files that are published: reading them executes no code."""
LARGEST_FILE = 12_000_000
"""Maximum size of a published file [bytes]; later stages need only a larger one's digest. Training states fit."""
NEW = ".new"
"""Ending of the folder of an unfinished copy."""


class Store:
    """Artifacts by stage and key."""

    def __init__(self, runs: Runs) -> None:
        self.runs = runs

    def folder(self, stage: str, key: str) -> Path:
        """Folder of an artifact, which need not exist."""
        return self.runs.store / stage / key

    def find(self, stage: str, key: str, *, published: bool = False) -> Artifact | None:
        """The artifact in the store, or with `published` the published one; None if there is none. Raises `Damaged` if
        its manifest is damaged."""
        folder = (self.runs.published if published else self.runs.store) / stage / key
        return read_artifact(folder, stage, key, published=published) if folder.is_dir() else None

    def checked(self, stage: str, key: str, *, published: bool = False) -> tuple[Artifact | None, str]:
        """The artifact of `find` after verification of its files, or None with the damage."""
        try:
            if (artifact := self.find(stage, key, published=published)) is not None:
                artifact.verify()
        except Damaged as error:
            return None, str(error)
        return artifact, ""

    def find_any(self, stage: str, key: str) -> Artifact | None:
        """The artifact in the store, else the published one; None if neither has an undamaged manifest."""
        for published in (False, True):
            with suppress(Damaged):
                if (artifact := self.find(stage, key, published=published)) is not None:
                    return artifact
        return None

    def artifacts(self, stage: str | None = None) -> list[Artifact]:
        """All readable artifacts, of one stage or all, oldest first; local ones replace published ones of their key."""
        roots = (self.runs.store, self.runs.published)
        folders = [folder for root in roots for folder in root.glob(f"{stage or '*'}/*")]
        keys = dict.fromkeys((folder.parent.name, folder.name) for folder in folders)
        found = filter(None, (self.find_any(*key) for key in keys))
        return sorted(found, key=lambda artifact: artifact.manifest.made)

    def published(self, stage: str) -> list[Artifact]:
        """The readable published artifacts of a stage, oldest first."""
        found: list[Artifact] = []
        for folder in self.runs.published.glob(f"{stage}/*"):
            with suppress(Damaged):
                found += filter(None, [self.find(stage, folder.name, published=True)])
        return sorted(found, key=lambda artifact: artifact.manifest.made)

    def add(self, out: Path, stage: str, key: str) -> Artifact:
        """Move sealed output into the store, replacing an existing artifact."""
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

    def publish(self, artifact: Artifact, without: Collection[str] = ()) -> Artifact:
        """Copy an artifact to `runs/published/` and verify it; one process at a time. Files of other kinds, large ones
        and those in `without` are left out and named in its manifest; what a dead process left is restored or removed.
        """
        with named_lock(lock_path(self.runs, PUBLISHING)):
            for leftover in self.runs.published.glob("*/.*"):
                if leftover.suffix == OLD:
                    restore_folder(leftover)
                elif leftover.suffix == NEW:
                    shutil.rmtree(leftover)
            made = artifact.manifest
            target = self.runs.published / made.stage / made.key
            unfinished = target.with_name(f".{made.key}{NEW}")
            left_out = {*made.omitted, *without}
            omitted = tuple(
                name
                for name, record in made.files.items()
                if name in left_out or record.size > LARGEST_FILE or Path(name).suffix not in KINDS
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
