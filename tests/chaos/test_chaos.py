"""The short form of `make chaos`: a few events of drawn kinds cost nothing that was finished."""

from pathlib import Path

import pytest
from chaos import play, table


def test_a_few_disturbances_lose_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FAKE_SENDER", "off")
    chaos = play(None, events=5, seed=1, folder=tmp_path)
    total = table(chaos).splitlines()[-1]
    assert total == "| all | 5 | 0 | 0 | 0 |", table(chaos)
