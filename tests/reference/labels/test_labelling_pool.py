"""Labelling in processes: the same result for any number of them, after crashes, damage and interruption."""

import shutil
import signal
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import psutil
import pytest
from reference_doubles import DoubleTask
from stage_jobs import Backwards

from iowbc.errors import Interrupted, WorkerFailed
from iowbc.reference.labels.dataset import Shard, read_shard
from iowbc.reference.labels.pool import CRASHED, _on_death, _Queue, _Worker, label_all
from iowbc.stages.rg_dataset import label_everywhere

COUNT, CHUNK = 40, 8


def run(folder: Path, task: DoubleTask | None = None, *, workers: int = 1, key: str = "key", **changes: Any) -> Shard:
    settings: dict[str, Any] = {"interrupted": lambda: False, "progress": lambda done, total: None, **changes}
    return label_all(
        task or DoubleTask(), range(COUNT), folder=folder, key=key, chunk_size=CHUNK, workers=workers, **settings
    )


def same(a: Shard, b: Shard) -> bool:
    return (
        np.array_equal(a.kept, b.kept)
        and np.array_equal(a.rejected, b.rejected)
        and list(a.reasons) == list(b.reasons)
        and np.array_equal(a.labels["support"], b.labels["support"])
    )


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The shards of a whole run."""
    folder = tmp_path_factory.mktemp("finished")
    run(folder)
    return folder


@pytest.fixture(scope="module")
def expected(finished: Path) -> Shard:
    return run(finished)


@pytest.fixture
def shards(finished: Path, tmp_path: Path) -> Path:
    """A copy of the shards, to harm."""
    return Path(shutil.copytree(finished, tmp_path / "shards"))


def test_each_sample_is_labelled_or_has_a_reason(expected: Shard) -> None:
    assert sorted([*expected.kept, *expected.rejected]) == list(range(COUNT))
    np.testing.assert_array_equal(expected.labels["support"][:, 0], expected.kept)
    assert set(expected.reasons) == {"a third"}


def test_shards_of_other_machines_are_the_same_and_only_missing_ones_are_made(shards: Path, expected: Shard) -> None:
    for number in (1, 2, 4):
        (shards / f"{number:05d}.shard").unlink()
    spread: Any = Backwards()
    task: Any = DoubleTask()
    elsewhere = partial(label_everywhere, spread, task, "key", CHUNK)
    assert same(run(shards, task, elsewhere=elsewhere), expected)
    assert spread.calls == 3


@pytest.mark.parametrize("workers", [2, 5])
def test_the_number_of_workers_changes_nothing(tmp_path: Path, expected: Shard, workers: int) -> None:
    assert same(run(tmp_path, workers=workers), expected)


def test_a_native_crash_ends_one_sample(tmp_path: Path, expected: Shard) -> None:
    result = run(tmp_path, DoubleTask(crashes=(10, 13, 31)), workers=2)
    lost = dict(zip(result.rejected.tolist(), result.reasons, strict=True))
    assert [index for index, reason in lost.items() if reason == CRASHED] == [10, 13, 31]
    assert set(result.kept) == set(expected.kept) - {10, 13, 31}


@pytest.mark.parametrize("code", [*range(-64, 0), 1, 77])
def test_only_what_a_solver_does_to_itself_rejects_a_sample(code: int) -> None:
    queue = _Queue([])
    process: Any = SimpleNamespace(exitcode=code, join=lambda: None)
    _on_death(_Worker(process, SimpleNamespace(close=lambda: None), SimpleNamespace(value=13), chunk=2), queue)  # type: ignore[arg-type]
    own = -code in (signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE, signal.SIGBUS, signal.SIGILL)
    assert (queue.crashed, queue.killed) == (({2: [13]}, 0) if own else ({}, 1))
    assert queue.waiting == [2], "its chunk is made again"


def test_a_killed_worker_costs_no_sample(tmp_path: Path, expected: Shard) -> None:
    marks = tmp_path / "killed"
    marks.mkdir()
    result = run(tmp_path / "shards", DoubleTask(killed=(4, 13, 31), marks=str(marks)), workers=2)
    assert len(list(marks.iterdir())) == 3
    assert same(result, expected)


def test_workers_that_are_killed_again_and_again_end_the_stage(tmp_path: Path) -> None:
    with pytest.raises(WorkerFailed, match=r"5 labelling workers were ended from outside .*exit code -9, on sample 13"):
        run(tmp_path, DoubleTask(killed=(13,)))


def test_workers_that_cannot_start_end_the_stage_with_advice(tmp_path: Path) -> None:
    with pytest.raises(WorkerFailed, match=r"end before their first sample \(exit code -11\).*iowbc doctor"):
        run(tmp_path, DoubleTask(start=False))


def test_an_error_in_python_is_shown(tmp_path: Path) -> None:
    with pytest.raises(WorkerFailed, match=r"(?s)a labelling worker failed.*KeyError: 'a mistake at 20'"):
        run(tmp_path, DoubleTask(mistakes=(20,)))


def test_finished_shards_are_used_again(shards: Path, expected: Shard) -> None:
    before = {path: path.stat().st_mtime_ns for path in shards.glob("*.shard")}
    ready: list[int] = []
    result = run(shards, DoubleTask(start=False), progress=lambda done, total: ready.append(done))
    assert same(result, expected)
    assert ready == [COUNT]
    assert {path: path.stat().st_mtime_ns for path in shards.glob("*.shard")} == before


def test_damaged_shards_are_made_anew(shards: Path, expected: Shard) -> None:
    paths = sorted(shards.glob("*.shard"))
    paths[0].write_bytes(paths[0].read_bytes()[:-40])
    paths[1].unlink()
    paths[2].write_bytes(b"")
    content = bytearray(paths[4].read_bytes())
    content[-200] ^= 1
    paths[4].write_bytes(content)
    untouched = paths[3].stat().st_mtime_ns
    assert same(run(shards, workers=2), expected)
    assert paths[3].stat().st_mtime_ns == untouched


def test_a_shard_of_other_samples_or_another_key_is_not_taken(shards: Path) -> None:
    path = shards / "00004.shard"
    shard = read_shard(path, "key", range(32, 40))
    assert shard is not None
    assert read_shard(path, "another key", range(32, 40)) is None
    assert read_shard(path, "key", range(31, 39)) is None


def stop_after(samples: int) -> tuple[Callable[[], bool], Callable[[int, int], None]]:
    done = [0]

    def progress(ready: int, total: int) -> None:
        done[0] = ready

    return (lambda: done[0] >= samples), progress


def test_an_interruption_keeps_finished_shards_and_leaves_no_process(tmp_path: Path, expected: Shard) -> None:
    interrupted, progress = stop_after(16)
    with pytest.raises(Interrupted):
        run(tmp_path, DoubleTask(pause=0.02), workers=2, interrupted=interrupted, progress=progress)
    assert not [child for child in psutil.Process().children() if "spawn_main" in " ".join(child.cmdline())]
    assert 2 <= len(list(tmp_path.glob("*.shard"))) < 5
    assert same(run(tmp_path), expected)
