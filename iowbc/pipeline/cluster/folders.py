"""Transfer of folders between machines, as file contents with a digest."""

import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ray

from iowbc.errors import Damaged, StageFailed
from iowbc.files import folder_digest, folder_files, replacing
from iowbc.pipeline.code import identity, mismatch
from iowbc.pipeline.store.locks import named_lock

Files = Mapping[str, bytes]
"""Content by relative name."""


@dataclass(frozen=True)
class SharedFolder:
    """A folder of the driver that tasks on other nodes read."""

    path: str
    """Its place on the driver."""
    digest: str
    """Digest of file names and contents."""
    content: tuple[Any, ...]
    """Ray's reference to its files; inside a tuple, so that Ray does not fetch it unless requested."""
    driver: Mapping[str, str]
    """Its `identity()`."""
    copy: bool
    """True if a node uses a local copy even where it sees the driver's folder."""


def files_of(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder_files(folder)}


def write_files(folder: Path, files: Files) -> None:
    """Write files below a folder, replacing existing ones."""
    for name, content in files.items():
        with replacing(folder / name) as fresh:
            fresh.write_bytes(content)


def placed(folder: SharedFolder) -> Path:
    """Path of the folder on this machine: the driver's, if visible here, else a local copy.

    The copy is cached for this user's later stages under the folder's own name, which is the key of an artifact. Raises
    `StageFailed` if code or package versions differ from the driver's, `Damaged` if the transferred content differs or
    the cache belongs to another user.
    """
    if different := mismatch(folder.driver, identity()):
        raise StageFailed(f"a node is not as the driver: {different}; install the same on both")
    there = Path(folder.path)
    if not folder.copy and there.is_dir() and folder_digest(there) == folder.digest:
        return there
    cache = Path(tempfile.gettempdir(), f"iowbc-{os.getuid()}")
    cache.mkdir(exist_ok=True, mode=0o700)
    if cache.stat().st_uid != os.getuid():
        raise Damaged(f"{cache} belongs to another user, who could change what stages read; remove it, or set TMPDIR")
    own = cache / "inputs" / folder.digest / there.name
    with named_lock(own.with_name("lock")):  # another task on this machine may fetch the same folder
        if own.is_dir() and folder_digest(own) == folder.digest:
            return own
        shutil.rmtree(own, ignore_errors=True)
        with replacing(own) as fresh:
            fresh.mkdir()
            write_files(fresh, ray.get(folder.content[0]))
            if folder_digest(fresh) != folder.digest:
                raise Damaged(f"{folder.path} differs from its digest after its way through Ray's object store")
    return own
