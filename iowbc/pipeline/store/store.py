"""The artifact store: `runs/store/<stage>/<key>/`, and behind it `runs/published/`, which came with the repository."""

import os
import time
from contextlib import suppress
from pathlib import Path

from iowbc.errors import Damaged
from iowbc.files import move_folder, replace_folder
from iowbc.pipeline.store.artifact import Artifact, read_artifact
from iowbc.pipeline.store.runs import Runs


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
