"""Published artifacts: copies in `runs/published/`, for the repository, of small files of safe types."""

import shutil
from collections.abc import Collection
from pathlib import Path

from iowbc.files import OLD, replace_folder, restore_folder, synchronise
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
LARGEST_REPOSITORY = 45_000_000
"""Maximum size of all published files [bytes], so that cloning stays fast."""


def publish(runs: Runs, artifact: Artifact, without: Collection[str] = ()) -> Artifact:
    """Copy an artifact to `runs/published/` and verify it; one process at a time. Files of other kinds, large ones and
    those in `without` are left out and named in its manifest; what a dead process left is restored or removed."""
    with named_lock(lock_path(runs, PUBLISHING)):
        for leftover in runs.published.glob("*/.*"):
            if leftover.suffix == OLD:
                restore_folder(leftover)
            elif leftover.suffix == NEW:
                shutil.rmtree(leftover)
        made = artifact.manifest
        target = runs.published / made.stage / made.key
        unfinished = target.with_name(f".{made.key}{NEW}")
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
    """Size of all published files [bytes]."""
    return sum(path.stat().st_size for path in runs.published.rglob("*") if path.is_file())
