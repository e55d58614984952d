"""`make scale` measures one node against two and names its figures."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

import pytest
import scaling
from stage_jobs import Backwards


def timed(count: int, work: Callable[[], None]) -> scaling.Throughput:
    """Two seconds, on a machine that is half busy."""
    work()
    return scaling.Throughput(count, 2.0, 1.0)


def test_rates_efficiencies_times_and_sizes_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[int] = []

    @contextmanager
    def here(cores: Sequence[int]) -> Iterator[None]:
        begun.append(len(cores))
        yield None

    monkeypatch.setattr(scaling, "connected_nodes", here)
    monkeypatch.setattr(scaling, "spread_over", lambda cluster, paths: Backwards())
    monkeypatch.setattr(scaling, "label_all", lambda *words, **settings: None)
    monkeypatch.setattr(scaling, "_timed", timed)
    monkeypatch.setattr(scaling, "SHARES", 1)
    monkeypatch.setattr(scaling, "TRIALS", 2)
    monkeypatch.setattr(scaling, "DURATION", 0.1)
    monkeypatch.setattr(scaling, "ENVIRONMENTS", 2)
    monkeypatch.setattr(scaling, "ROLLOUTS", 1)
    lines: list[str] = []
    figures = scaling.main(turns=1, say=lines.append)
    assert begun == [1, 2]
    kinds = ("1", "2", "efficiency", "a_core_1", "a_core_2")
    assert {f"{name}_{kind}" for name in ("labels", "trials", "rollouts") for kind in kinds} <= set(figures)
    assert all(value > 0 for value in figures.values())
    assert figures["trials_efficiency"] == pytest.approx(figures["trials_2"] / (2 * figures["trials_1"])) == 1.0
    assert figures["answer_bytes"] < figures["inputs_bytes"]
    assert lines[2].startswith("labels ")
    assert lines[4].startswith("rollouts ")
