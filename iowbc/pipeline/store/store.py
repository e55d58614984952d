"""The artifact store: `runs/store/<stage>/<key>/`, published whole, checked when used."""

import json
import os
import shutil
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from iowbc.errors import Damaged
from iowbc.files import synchronise, write_whole
from iowbc.pipeline.stage import SUMMARY
from iowbc.pipeline.store.digests import content_digest, file_digest
from iowbc.pipeline.store.runs import Runs, read_json

if TYPE_CHECKING:
    import pandas as pd

MANIFEST = "manifest.json"
INGREDIENTS = "key.json"
RECIPE = "recipe.yaml"
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
RECORDS = (MANIFEST, INGREDIENTS, RECIPE)
"""What the runner adds to a stage's own files."""


class FileRecord(BaseModel):
    """A published file."""

    model_config = ConfigDict(frozen=True)

    sha256: str
    size: int


class Manifest(BaseModel):
    """What an artifact is, written last."""

    model_config = ConfigDict(frozen=True)

    stage: str
    version: int
    key: str
    digest: str
    """Digest of the names and contents of the stage's files."""
    files: dict[str, FileRecord]
    recipe: str
    """Name of the recipe that made it."""
    made: float
    """When it was published [s since 1970]."""
    seconds: float
    """Time that the stage took, over all attempts [s]."""
    attempts: int
    workers: int
    host: str
    code: dict[str, str]
    """Digests of the code that made it, by subpackage."""
    versions: dict[str, str]


@dataclass(frozen=True)
class Artifact:
    """A finished stage's folder and its manifest."""

    folder: Path
    manifest: Manifest

    @property
    def ingredients(self) -> dict[str, Any]:
        """What its key was computed from."""
        return read_json(self.folder / INGREDIENTS) or {}

    @property
    def recipe(self) -> dict[str, Any]:
        """The resolved recipe that it was made with; empty where that is not readable."""
        try:
            found = yaml.load((self.folder / RECIPE).read_bytes(), Loader=_LOADER)
        except (OSError, yaml.YAMLError):
            return {}
        return found if isinstance(found, dict) else {}

    @property
    def size(self) -> int:
        """Bytes of the stage's files."""
        return sum(record.size for record in self.manifest.files.values())

    @property
    def metrics(self) -> dict[str, float]:
        """The metrics that the stage left in its summary."""
        summary = read_json(self.folder / SUMMARY)
        metrics = summary.get("metrics") if isinstance(summary, dict) else None
        if not isinstance(metrics, dict):
            return {}
        return {str(name): float(value) for name, value in metrics.items() if isinstance(value, (int, float))}

    def table(self, name: str) -> "pd.DataFrame":
        """A table of the artifact as a pandas frame: `trials` for `trials.parquet`, `summary` for `tables/summary.csv`.

        Raises `KeyError` with the names that there are.
        """
        import pandas as pd

        paths = [*self.folder.glob("*.parquet"), *(self.folder / "tables").glob("*.csv")]
        found = {path.stem: path for path in sorted(paths)}
        if name not in found:
            raise KeyError(f"{self.folder} has no table '{name}'; it has: {', '.join(found) or 'none'}")
        return pd.read_parquet(found[name]) if found[name].suffix == ".parquet" else pd.read_csv(found[name])


class Store:
    """Artifacts by stage and key."""

    def __init__(self, runs: Runs) -> None:
        self.runs = runs

    def folder(self, stage: str, key: str) -> Path:
        """Where the artifact of a stage and key stands, or would stand."""
        return self.runs.store / stage / key

    def find(self, stage: str, key: str) -> Artifact | None:
        """The artifact, or None. Raises `Damaged` where its manifest is not readable."""
        folder = self.folder(stage, key)
        return _read(folder, stage, key) if folder.is_dir() else None

    def sealed(self, out: Path, stage: str, key: str) -> bool:
        """True where a folder that is not published yet holds a whole artifact. Raises `Damaged` where it does not."""
        self.verify(_read(out, stage, key))
        return True

    def verify(self, artifact: Artifact) -> None:
        """Compare every file with its digest. Raises `Damaged`."""
        for name, record in artifact.manifest.files.items():
            path = artifact.folder / name
            if not path.is_file():
                raise Damaged(f"{name} is missing")
            if path.stat().st_size != record.size:
                raise Damaged(f"{name} has {path.stat().st_size} bytes instead of {record.size}")
            if file_digest(path) != record.sha256:
                raise Damaged(f"{name} differs from its digest")

    def artifacts(self, stage: str | None = None) -> list[Artifact]:
        """All readable artifacts, of one stage or of all, oldest first."""
        found = []
        for folder in self.runs.store.glob(f"{stage or '*'}/*"):
            try:
                artifact = self.find(folder.parent.name, folder.name)
            except Damaged:
                continue
            if artifact is not None:
                found.append(artifact)
        return sorted(found, key=lambda artifact: artifact.manifest.made)

    def seal(self, out: Path, details: Mapping[str, Any], ingredients: Mapping[str, Any], recipe: str) -> None:
        """Make a stage's output publishable: records beside it, everything on disk, the manifest last.

        `details` are the fields of `Manifest` that do not follow from the files.
        """
        files = {
            path.relative_to(out).as_posix(): FileRecord(sha256=file_digest(path), size=path.stat().st_size)
            for path in sorted(out.rglob("*"))
            if path.is_file() and path.relative_to(out).as_posix() not in RECORDS
        }
        digest = content_digest({name: record.sha256 for name, record in files.items()})
        manifest = Manifest(**details, digest=digest, files=files, made=time.time())
        write_whole(out / INGREDIENTS, json.dumps(ingredients, indent=1, sort_keys=True))
        write_whole(out / RECIPE, recipe)
        for name in (*files, INGREDIENTS, RECIPE):
            synchronise(out / name)
        write_whole(out / MANIFEST, manifest.model_dump_json(indent=1))
        synchronise(out / MANIFEST)

    def publish(self, out: Path, stage: str, key: str) -> Artifact:
        """Rename sealed output into the store; an artifact that stands there already goes with the work folder."""
        folder = self.folder(stage, key)
        folder.parent.mkdir(parents=True, exist_ok=True)
        if folder.exists():
            replaced = out.with_name("replaced")
            shutil.rmtree(replaced, ignore_errors=True)
            os.rename(folder, replaced)
        os.rename(out, folder)
        synchronise(folder.parent)
        artifact = self.find(stage, key)
        assert artifact is not None
        return artifact

    def set_aside(self, stage: str, key: str) -> Path:
        """Move a damaged artifact out of the store; returns where it lies now."""
        stamp = time.strftime("%Y%m%d-%H%M%S")
        target = self.runs.damaged / f"{stage}-{key[:12]}-{stamp}-{os.getpid()}"
        target.parent.mkdir(parents=True, exist_ok=True)
        os.rename(self.folder(stage, key), target)
        return target


def _read(folder: Path, stage: str, key: str) -> Artifact:
    try:
        manifest = Manifest.model_validate_json((folder / MANIFEST).read_bytes())
    except OSError:
        raise Damaged(f"{MANIFEST} is missing") from None
    except ValidationError:
        raise Damaged(f"{MANIFEST} is not readable") from None
    if (manifest.stage, manifest.key) != (stage, key):
        raise Damaged(f"{MANIFEST} belongs to {manifest.stage} {manifest.key}")
    return Artifact(folder, manifest)
