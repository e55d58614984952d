from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from iowbc.files import previous
from iowbc.learning import checkpoint


def test_a_checkpoint_of_another_key_is_not_used(tmp_path: Path) -> None:
    path, said = tmp_path / "training.checkpoint", list[str]()
    checkpoint.save_checkpoint(path, "one", {"x": np.arange(3)})
    found = checkpoint.load_checkpoint(path, "one", said.append)
    assert found is not None
    assert found["x"].tolist() == [0, 1, 2]
    assert checkpoint.load_checkpoint(path, "two", said.append) is None
    assert checkpoint.load_checkpoint(tmp_path / "none", "one", said.append) is None
    assert said == []


def truncated(content: bytes) -> bytes:
    return content[:40]


def flipped(content: bytes) -> bytes:
    return content[:-1] + bytes([content[-1] ^ 1])


@pytest.mark.parametrize("damage", [truncated, flipped, lambda content: b"", lambda content: bytes(len(content))])
def test_a_damaged_checkpoint_is_named_and_the_previous_one_used(
    damage: Callable[[bytes], bytes], tmp_path: Path
) -> None:
    path, said = tmp_path / "training.checkpoint", list[str]()
    for rounds in (1, 2, 3):
        checkpoint.save_checkpoint(path, "k", {"x": np.arange(rounds)})
    path.write_bytes(damage(path.read_bytes()))
    found = checkpoint.load_checkpoint(path, "k", said.append)
    assert found is not None
    assert len(found["x"]) == 2
    assert said == ["checkpoint training.checkpoint is damaged: goes on from the previous one"]

    assert (tmp_path / "training.checkpoint.damaged").is_file()
    checkpoint.save_checkpoint(path, "k", {"x": np.arange(3)})
    path.unlink()
    found = checkpoint.load_checkpoint(path, "k", said.append)
    assert found is not None
    assert len(found["x"]) == 2, "the previous one is still the whole one"

    previous(path).unlink()
    path.write_bytes(b"damaged")
    said.clear()
    assert checkpoint.load_checkpoint(path, "k", said.append) is None
    assert said == ["checkpoint training.checkpoint is damaged: starts anew"]


def test_an_unfinished_write_leaves_the_old_checkpoint(tmp_path: Path) -> None:
    path, said = tmp_path / "training.checkpoint", list[str]()
    checkpoint.save_checkpoint(path, "k", {"x": np.arange(3)})
    (tmp_path / ".training.checkpoint.7").write_bytes(b"half")
    assert checkpoint.load_checkpoint(path, "k", said.append) is not None
    path.rename(previous(path))
    assert checkpoint.load_checkpoint(path, "k", said.append) is not None
    assert said == []
