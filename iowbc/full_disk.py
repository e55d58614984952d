"""Detection of errors caused by a full disk, quota or file-size limit, and the disk or file that is full."""

import errno
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of a full disk, an exhausted quota, and the file-size limit."""
TEXTS = ("No space left on device", "Disk quota exceeded", "File too large", "PytorchStreamWriter failed writing")
"""What libraries say that turn such an error into one of their own."""
ROOM = 100_000
"""Free bytes below which a disk counts as full."""


def is_disk_full(error: BaseException) -> bool:
    """True if an error, or one in its chain of causes, means that nothing more can be written."""
    return any(
        (isinstance(found, OSError) and found.errno in FULL) or any(text in str(found) for text in TEXTS)
        for found in _chain(error)
    )


def what_is_full(error: BaseException, places: Sequence[Path]) -> str:
    """Disk that is full, with its free bytes, else the file that an error names."""
    files = [_file(found) for found in _chain(error) if isinstance(found, OSError) and _file(found)]
    for place in (*(Path(file).parent for file in files), *places):
        if (free := _free(place)) is not None and free < ROOM:
            return f"the disk of {place} is full ({free:,} bytes are free)"
    for found in _chain(error):
        if isinstance(found, OSError) and found.errno in FULL:
            return f"{_file(found) or 'a file'} cannot be written: {found.strerror}"
    return "a file cannot be written: no space is left"


def _file(error: OSError) -> str:
    """The file that could not be written: of two, as in a copy, the second."""
    return str(error.filename2 or error.filename or "")


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def _free(place: Path) -> int | None:
    """Bytes that this user can still write on the disk of a place or of the nearest folder above it."""
    while not place.exists() and place != place.parent:
        place = place.parent
    try:
        return 0 if os.statvfs(place).f_favail == 0 < os.statvfs(place).f_files else shutil.disk_usage(place).free
    except OSError:
        return None
