"""A finished stage's folder: its manifest, how it is sealed, and how damage is noticed."""

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from iowbc.errors import Damaged
from iowbc.files import content_digest, data_digest, file_digest, synchronise, write_whole
from iowbc.pipeline.stage import SUMMARY
from iowbc.pipeline.store.runs import read_json, read_yaml

MANIFEST = "manifest.json"
INGREDIENTS = "key.json"
RECIPE = "recipe.yaml"
BESIDE = (INGREDIENTS, RECIPE)
"""Files that are added to a stage's own."""


class FileRecord(BaseModel, frozen=True):
    """A file of an artifact."""

    sha256: str
    size: int


class Manifest(BaseModel, frozen=True):
    """Description of an artifact, written last."""

    stage: str
    version: int
    key: str
    digest: str
    """Digest of the names and contents of the results; the keys of the stages that read it hold it."""
    files: dict[str, FileRecord]
    """All files of the stage."""
    results: tuple[str, ...]
    """Those among them that decide later stages; the others are records: curves, times, pictures."""
    omitted: tuple[str, ...] = ()
    """Files that a published copy leaves out because of size or type, or on request."""
    beside: dict[str, FileRecord]
    """The key's ingredients, and the recipe."""
    recipe: str
    """Name of the recipe that made it."""
    made: float
    """Time of completion [s since 1970]."""
    seconds: float
    """Time that the stage took, over all attempts [s]."""
    attempts: int
    workers: int
    host: str
    code: dict[str, str]
    """Digests of the code that made it, by subpackage."""
    versions: dict[str, str]
    seal: str = ""
    """Digest of all of the above."""


@dataclass(frozen=True)
class Artifact:
    """A finished stage's folder and its manifest."""

    folder: Path
    manifest: Manifest
    published: bool = False
    """True where it came with the repository, and is only read."""

    @property
    def whole(self) -> bool:
        """True where all results are there; of a published one, large files may be missing."""
        return not set(self.manifest.omitted) & set(self.manifest.results)

    @property
    def ingredients(self) -> dict[str, Any]:
        """Ingredients of its key; empty where they are not readable or do not give the key."""
        found = read_json(self.folder / INGREDIENTS)
        return found if _has_digest(found, self.manifest.key) else {}

    @property
    def recipe(self) -> dict[str, Any]:
        """The resolved recipe that it was made with; empty where that is not readable."""
        return read_yaml(self.folder / RECIPE)

    @property
    def size(self) -> int:
        """Bytes of the stage's files."""
        return sum(record.size for name, record in self.manifest.files.items() if name not in self.manifest.omitted)

    @property
    def metrics(self) -> dict[str, float]:
        """The metrics that the stage left in its summary."""
        metrics = read_json(self.folder / SUMMARY).get("metrics")
        if not isinstance(metrics, dict):
            return {}
        return {str(name): float(value) for name, value in metrics.items() if isinstance(value, (int, float))}

    def verify(self) -> None:
        """Compare everything with its digest. Raises `Damaged`."""
        manifest = self.manifest
        for name, record in (manifest.files | manifest.beside).items():
            path = self.folder / name
            if name in manifest.omitted:
                continue
            if not path.is_file():
                raise Damaged(f"{name} is missing")
            if path.stat().st_size != record.size:
                raise Damaged(f"{name} has {path.stat().st_size} bytes instead of {record.size}")
            if file_digest(path) != record.sha256:
                raise Damaged(f"{name} differs from its digest")
        if not self.ingredients:
            raise Damaged(f"{INGREDIENTS} does not give the key")


def seal(
    out: Path, results: Sequence[str], details: Mapping[str, Any], ingredients: Mapping[str, Any], recipe: str
) -> None:
    """Turn a stage's output into an artifact: add key and recipe, sync all files, write the manifest last. results: as
    in `Stage`; each must match a file. details: fields of `Manifest` that are not computed from the files."""
    files = {
        path.relative_to(out).as_posix(): _record(path)
        for path in sorted(out.rglob("*"))
        if path.is_file() and path.relative_to(out).as_posix() not in (MANIFEST, *BESIDE)
    }
    lacking = [pattern for pattern in results if not any(fnmatchcase(name, pattern) for name in files)]
    if lacking:
        raise ValueError(f"{out} has none of the results that the stage declares: {', '.join(lacking)}")
    deciding = tuple(name for name in files if any(fnmatchcase(name, pattern) for pattern in results))
    describe(out, ingredients, recipe)
    for name in files:
        synchronise(out / name)
    manifest = Manifest(
        **details,
        digest=content_digest({name: files[name].sha256 for name in deciding}),
        files=files,
        results=deciding,
        beside={name: _record(out / name) for name in BESIDE},
        made=time.time(),
    )
    write_manifest(out, manifest)


def describe(folder: Path, ingredients: Mapping[str, Any], recipe: str) -> None:
    """Write the files beside a stage's own: the ingredients of the key, and the recipe."""
    write_whole(folder / INGREDIENTS, json.dumps(ingredients, indent=1, sort_keys=True))
    write_whole(folder / RECIPE, recipe)


def write_manifest(folder: Path, manifest: Manifest) -> None:
    """Seal and write a manifest; call it after all other files are written."""
    seal = data_digest(manifest.model_dump(mode="json", exclude={"seal"}))
    write_whole(folder / MANIFEST, manifest.model_copy(update={"seal": seal}).model_dump_json(indent=1))


def read_artifact(folder: Path, stage: str, key: str, *, published: bool = False) -> Artifact:
    """The artifact in a folder. Raises `Damaged` if its manifest is missing, altered, or of another artifact."""
    if not (folder / MANIFEST).is_file():
        raise Damaged(f"{MANIFEST} is missing")
    found = read_json(folder / MANIFEST)
    whole = _has_digest({name: entry for name, entry in found.items() if name != "seal"}, found.get("seal"))
    try:
        manifest = Manifest.model_validate(found)
    except ValidationError:
        text = "was written by a newer version of iowbc: use that here" if whole else "is not readable"
        raise Damaged(f"{MANIFEST} {text}") from None
    if (manifest.stage, manifest.key) != (stage, key):
        raise Damaged(f"{MANIFEST} belongs to {manifest.stage} {manifest.key}")
    if not whole:
        raise Damaged(f"{MANIFEST} differs from its seal")
    return Artifact(folder, manifest, published)


def _has_digest(data: Mapping[str, Any], digest: str | None) -> bool:
    """True for data as they were written, a manifest's also by a newer version with more entries; False for damaged."""
    try:
        return data_digest(data) == digest
    except ValueError:  # a damaged number may be NaN
        return False


def _record(path: Path) -> FileRecord:
    return FileRecord(sha256=file_digest(path), size=path.stat().st_size)
