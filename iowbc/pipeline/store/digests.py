"""Digests: of data, of files and of folders."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from iowbc.files import file_digest


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
