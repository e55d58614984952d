"""Digests, and atomic file writes: a reader, also after a crash during a write, finds the old content or the new.

A checked file is also protected by a checksum: its first line is JSON with the key that it belongs to and the SHA-256
of key and content.
"""

import errno
import hashlib
import json
import os
import shutil
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from iowbc.errors import Damaged

OLD = ".old"
"""How the hidden name of a folder ends that is being replaced."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields a path beside `path` to write a file or folder to, which is then on disk and takes the place of `path`.

    Where the block raises, `path` stays as it was.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield fresh
        synchronise(fresh)
        os.replace(fresh, path)
    except BaseException:
        shutil.rmtree(fresh) if fresh.is_dir() else fresh.unlink(missing_ok=True)
        raise


def write_whole(path: Path, text: str) -> None:
    """Create or replace a text file atomically."""
    with replacing(path) as fresh:
        fresh.write_text(text, encoding="utf-8")


def move_folder(source: Path, target: Path) -> None:
    """Rename a folder; to another file system by way of a copy, which takes its name once it is on disk."""
    try:
        os.rename(source, target)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        fresh = target.with_name(f".{target.name}.moving")
        shutil.rmtree(fresh, ignore_errors=True)
        shutil.copytree(source, fresh, symlinks=True)
        for path in (*fresh.rglob("*"), fresh):
            if not path.is_symlink():
                synchronise(path)
        os.rename(fresh, target)
        shutil.rmtree(source)
    synchronise(target.parent)


def replace_folder(source: Path, target: Path) -> None:
    """Replace a folder by another. The old one is removed last: a crash in between leaves it as `.NAME.old`, and the
    next call restores it."""
    old = target.with_name(f".{target.name}{OLD}")
    restore_folder(old)
    if target.exists():
        os.rename(target, old)
    move_folder(source, target)
    shutil.rmtree(old, ignore_errors=True)


def restore_folder(old: Path) -> None:
    """Restore a folder that `replace_folder` set aside if nothing has replaced it; else remove it."""
    target = old.with_name(old.name.removeprefix(".").removesuffix(OLD))
    if old.is_dir() and not target.exists():
        os.rename(old, target)
    shutil.rmtree(old, ignore_errors=True)


def read_limited(path: Path, largest: int) -> bytes:
    """Content of a regular file of `largest` bytes at most. Raises OSError, or ValueError for any other file."""
    if not stat.S_ISREG(path.stat().st_mode):
        raise ValueError(f"{path}: is no regular file")
    with path.open("rb") as opened:
        content = opened.read(largest + 1)
    if len(content) > largest:
        raise ValueError(f"{path}: has {path.stat().st_size:,} bytes; it may have {largest:,} at most")
    return content


def file_digest(path: Path) -> str:
    """SHA-256 of a file's bytes, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def data_digest(data: Any) -> str:
    """SHA-256 of the data's canonical JSON (sorted keys, no spaces, ASCII), hexadecimal. Raises ValueError for NaN."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def content_digest(files: Mapping[str, str]) -> str:
    """Digest of a set of files from their relative names and digests."""
    return data_digest(sorted(files.items()))


def folder_files(folder: Path) -> list[Path]:
    """Regular files below a folder in a fixed order, without hidden ones and caches."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return sorted(
        path
        for path in found
        if not any(part.startswith(".") or part == "__pycache__" for part in path.relative_to(folder).parts)
    )


def folder_digest(folder: Path) -> str:
    """Digest of all files of a folder, names and contents."""
    return content_digest({path.relative_to(folder).as_posix(): file_digest(path) for path in folder_files(folder)})


def synchronise(path: Path) -> None:
    """Return once the content of a file, or the names in a folder, are on disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_checked(path: Path, key: str, content: bytes, *, keep_previous: bool = False) -> None:
    """Write a checked file at `path`; `keep_previous` keeps the one that was there as its previous version."""
    head = json.dumps({"key": key, "sha256": _digest(key, content)}).encode()
    with replacing(path) as fresh:
        fresh.write_bytes(head + b"\n" + content)
        if keep_previous and path.is_file():
            synchronise(fresh)
            os.replace(path, previous(path))


def read_checked(path: Path, key: str) -> bytes | None:
    """Content of a checked file; None where there is none or it belongs to another key. Raises `Damaged`."""
    try:
        head, _, content = path.read_bytes().partition(b"\n")
    except FileNotFoundError:
        return None
    try:
        header = json.loads(head)
        own, digest = header["key"], header["sha256"]
    except (ValueError, KeyError, TypeError) as reason:
        raise Damaged(f"{path} has no readable head: {reason}") from reason
    if digest != _digest(str(own), content):
        raise Damaged(f"{path} differs from its digest")
    return content if own == key else None


def newest_checked(path: Path, key: str) -> tuple[bytes | None, list[str]]:
    """Content of the newest intact checked file, at `path` or its previous version, and the names of damaged ones.

    Damaged files are renamed to `<name>.damaged`, so that the next write does not keep one as the previous version.
    """
    damaged: list[str] = []
    for candidate in (path, previous(path)):
        try:
            content = read_checked(candidate, key)
        except Damaged:
            damaged.append(candidate.name)
            os.replace(candidate, candidate.with_name(f"{candidate.name}.damaged"))
            continue
        if content is not None:
            return content, damaged
    return None, damaged


def previous(path: Path) -> Path:
    """Path of the previous version of a checked file."""
    return path.with_suffix(".previous")


def _digest(key: str, content: bytes) -> str:
    return hashlib.sha256(key.encode() + b"\n" + content).hexdigest()
