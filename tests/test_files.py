"""Whole files and checked files: what a crash or a flipped bit leaves, and what a reader makes of it."""

import os
from pathlib import Path

import pytest

from iowbc.errors import Damaged
from iowbc.files import newest_checked, previous, read_checked, read_limited, replacing, write_checked

CONTENT = bytes(range(256))


def test_what_fails_while_it_is_written_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")

    def fill() -> None:
        with replacing(path) as fresh:
            fresh.write_bytes(b"half")
            raise OSError("full")

    with pytest.raises(OSError, match="full"):
        fill()
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_small_file_is_read_whole_and_none_that_is_larger_or_of_another_kind(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(CONTENT)
    assert read_limited(path, len(CONTENT)) == CONTENT
    with pytest.raises(ValueError, match=r"file: has 256 bytes; it may have 255 at most"):
        read_limited(path, 255)
    os.mkfifo(tmp_path / "pipe")
    for other in (tmp_path, tmp_path / "pipe", Path("/dev/zero")):
        with pytest.raises(ValueError, match="is no regular file"):
            read_limited(other, 10)
    with pytest.raises(FileNotFoundError):
        read_limited(tmp_path / "none", 10)


def test_a_checked_file_gives_back_what_was_written_for_its_key_alone(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_checked(path, "mine", CONTENT)
    assert read_checked(path, "mine") == CONTENT
    assert read_checked(path, "yours") is None
    assert read_checked(tmp_path / "none", "mine") is None


def test_every_flipped_bit_and_every_cut_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "file"
    write_checked(path, "k", CONTENT)
    written = path.read_bytes()
    for place in range(len(written)):
        changed = bytearray(written)
        changed[place] ^= 1
        path.write_bytes(changed)
        with pytest.raises(Damaged):
            read_checked(path, "k")
        path.write_bytes(written[:place])
        with pytest.raises(Damaged):
            read_checked(path, "k")


def test_a_damaged_file_is_put_aside_and_the_one_before_is_used(tmp_path: Path) -> None:
    path = tmp_path / "file.one"
    for content in (b"first", b"second", b"third"):
        write_checked(path, "k", content, keep_previous=True)
    assert newest_checked(path, "k") == (b"third", [])
    path.write_bytes(b"nonsense")
    assert newest_checked(path, "k") == (b"second", ["file.one"])
    assert (tmp_path / "file.one.damaged").read_bytes() == b"nonsense"
    write_checked(path, "k", b"fourth", keep_previous=True)
    assert read_checked(previous(path), "k") == b"second"
    previous(path).write_bytes(b"")
    path.unlink()
    assert newest_checked(path, "k") == (None, ["file.previous"])
