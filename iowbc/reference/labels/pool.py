"""Labels samples in worker processes, in shards on disk; a native crash of a solver costs one sample.

A sample is rejected only if its solver crashed. After a kill from outside, on which no label may depend, it is retried.
"""

import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import Any, Literal

import numpy as np

from iowbc.arrays import Array
from iowbc.errors import Interrupted, Rejected, WorkerFailed
from iowbc.processes import die_with_parent, single_threaded
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.checks import LabelChecker
from iowbc.reference.labels.dataset import Shard, merge, read_shard, write_shard
from iowbc.reference.labels.gauss_newton import StaticMethod
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.labels.support_model import Sample, SupportModel
from iowbc.robot.description import load_robot

CRASHED = "solver crashed"
CRASHES = tuple(-number for number in (signal.SIGSEGV, signal.SIGABRT, signal.SIGFPE, signal.SIGBUS, signal.SIGILL))
"""Exit codes of a worker whose solver crashed; after any other death the sample is retried."""
TRIES = 5
"""Number of other deaths at which labelling fails."""
POLL = 0.2
"""Interval of checking for interruption [s]."""
STARTS_WITHOUT_WORK = 3
"""Number of workers that die before their first sample at which labelling fails."""
IDLE = -1


@dataclass(frozen=True)
class LabelTask:
    """Specification from which a worker process builds its labeller."""

    robot: Path
    recipe: ReferenceGenerator
    seed: int
    method: Literal["static", "ocp"]

    def prepare(self) -> "Labeller":
        """Builds the models; called once in each worker."""
        return Labeller(self)


class Labeller:
    """Draws samples by their numbers, and solves and checks them one at a time."""

    def __init__(self, task: LabelTask) -> None:
        robot, recipe = load_robot(task.robot), task.recipe
        self.draw = SamplePlan(robot, recipe, task.seed).draw
        support = SupportModel(robot, recipe.problem, recipe.height)
        self.judge = LabelChecker(support, recipe.gates)
        if task.method == "ocp":  # crocoddyl is loaded only where it is used
            from iowbc.reference.labels.optimal_control import OptimalControlMethod

            self.method: StaticMethod | OptimalControlMethod = OptimalControlMethod(support, recipe)
        else:
            self.method = StaticMethod(support)

    def solve(self, sample: Sample) -> dict[str, Array]:
        """A label that passed every gate, as arrays named as in the dataset. Raises `Rejected`."""
        self.judge.arms(sample)
        posture = self.method.solve(sample)
        return {
            "support": posture.support,
            "base_position": posture.configuration[:3],
            "base_quaternion": np.roll(posture.configuration[3:7], 1),
            "wrench": posture.wrench,
            **self.judge.label(sample, posture),
        }


@dataclass
class _Worker:
    process: SpawnProcess
    connection: Connection
    current: Any
    """Shared number of the current sample."""
    chunk: int | None = None


@dataclass
class _Queue:
    """Remaining chunks, and samples that crashed a worker."""

    waiting: list[int]
    crashed: dict[int, list[int]] = field(default_factory=dict)
    failed_starts: int = 0
    killed: int = 0


def label_all(
    task: LabelTask,
    indices: Sequence[int],
    *,
    folder: Path,
    key: str,
    chunk_size: int,
    workers: int = 1,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[int, int], None] = lambda done, total: None,
    elsewhere: Callable[[list[list[int]]], Iterator[tuple[int, bytes]]] | None = None,
) -> Shard:
    """Labels the samples with these numbers. The result does not depend on the number of workers. Shards in `folder`
    that belong to `key` are reused, others recomputed. `elsewhere`: first makes the missing shards of these chunks on
    other machines, and yields the place and the file content of each. Raises `Interrupted` when `interrupted()` turns
    true, WorkerFailed when a worker fails in Python or cannot start, or when too many are killed."""
    folder.mkdir(parents=True, exist_ok=True)
    chunks = [list(indices[start : start + chunk_size]) for start in range(0, len(indices), chunk_size)]
    paths = [folder / f"{number:05d}.shard" for number in range(len(chunks))]
    done = {number: shard for number, path in enumerate(paths) if (shard := read_shard(path, key, chunks[number]))}
    progress(sum(len(chunks[number]) for number in done), len(indices))
    missing = [number for number in range(len(chunks)) if number not in done]
    for place, content in elsewhere([chunks[number] for number in missing]) if elsewhere is not None else ():
        chunk = missing[place]
        paths[chunk].write_bytes(content)
        if shard := read_shard(paths[chunk], key, chunks[chunk]):
            done[chunk] = shard
        progress(sum(len(chunks[number]) for number in done), len(indices))
    queue = _Queue([number for number in missing if number not in done])
    team = [_start_worker(task, key) for _ in range(min(max(workers, 1), len(queue.waiting)))]
    try:
        while len(done) < len(chunks):
            if interrupted():
                raise Interrupted("finished shards are kept")
            for worker in team:
                if worker.chunk is None and queue.waiting:
                    worker.chunk = chunk = queue.waiting.pop(0)
                    with suppress(BrokenPipeError, ConnectionResetError):  # _receive reports a dead worker
                        worker.connection.send((chunk, chunks[chunk], queue.crashed.get(chunk, []), paths[chunk]))
            ready = wait([worker.connection for worker in team], timeout=POLL)
            for worker in [worker for worker in team if worker.connection in ready]:
                number = _receive(worker)
                if number is None:
                    _on_death(worker, queue)
                    team[team.index(worker)] = _start_worker(task, key)
                    continue
                shard = read_shard(paths[number], key, chunks[number])
                if shard is None:
                    raise RuntimeError(
                        f"{paths[number]}: the shard just written cannot be read back; is the disk full?"
                    )
                done[number], worker.chunk = shard, None
                progress(sum(len(chunks[number]) for number in done), len(indices))
    finally:
        for worker in team:
            worker.process.kill()
            worker.process.join()
            worker.connection.close()
    return merge([done[number] for number in range(len(chunks))])


def _start_worker(task: LabelTask, key: str) -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    current = context.Value("q", IDLE, lock=False)
    bound = threading.current_thread() is threading.main_thread()
    process = context.Process(target=_work, args=(task, key, theirs, current, os.getpid(), bound), daemon=True)
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    try:
        with single_threaded():
            process.start()  # `_work` lifts the mask that it inherits
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    theirs.close()
    return _Worker(process, ours, current)


def _receive(worker: _Worker) -> int | None:
    """The finished chunk; None if the worker died."""
    try:
        number, failure = worker.connection.recv()
    except (EOFError, ConnectionResetError):
        return None
    if failure:
        raise WorkerFailed(f"a labelling worker failed:\n{failure}")
    return int(number)


def _on_death(worker: _Worker, queue: _Queue) -> None:
    """Records the sample on which a worker died, and puts its chunk back in the queue."""
    worker.process.join()
    worker.connection.close()
    sample = int(worker.current.value)
    if worker.chunk is None or sample == IDLE:
        queue.failed_starts += 1
        if queue.failed_starts >= STARTS_WITHOUT_WORK:
            raise WorkerFailed(
                f"labelling workers end before their first sample (exit code {worker.process.exitcode}); "
                "try `iowbc doctor`, which checks that crocoddyl and pinocchio fit together"
            )
    elif worker.process.exitcode in CRASHES:
        queue.crashed.setdefault(worker.chunk, []).append(sample)
    else:
        queue.killed += 1
        if queue.killed >= TRIES:
            raise WorkerFailed(
                f"{queue.killed} labelling workers were ended from outside (the last with exit code "
                f"{worker.process.exitcode}, on sample {sample}); finished shards are kept. Is there too little "
                "memory? Try fewer workers (`--workers`)"
            )
    if worker.chunk is not None:
        queue.waiting.insert(0, worker.chunk)


def _work(task: LabelTask, key: str, connection: Connection, current: Any, parent: int, bound: bool) -> None:
    for ignored in (signal.SIGINT, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())
    die_with_parent(parent, bound=bound)
    number = None
    try:
        solver = task.prepare()
        while True:
            number, indices, crashed, path = connection.recv()
            write_shard(path, key, _label_chunk(solver, indices, crashed, current))
            connection.send((number, ""))
    except (EOFError, BrokenPipeError):
        return
    except Exception:
        connection.send((number, traceback.format_exc()))


def _label_chunk(solver: Labeller, indices: Sequence[int], crashed: Sequence[int], current: Any) -> Shard:
    labels: dict[int, dict[str, Any]] = {}
    rejected: dict[int, str] = {}
    for index, sample in zip(indices, solver.draw(np.array(indices)), strict=True):
        if index in crashed:
            rejected[index] = CRASHED
            continue
        current.value = index
        try:
            labels[index] = solver.solve(sample)
        except Rejected as reason:
            rejected[index] = str(reason)
    current.value = IDLE
    names = next(iter(labels.values()), {})
    stacked = {name: np.stack([label[name] for label in labels.values()]) for name in names}
    kept, lost = (np.array(list(found), dtype=np.int64) for found in (labels, rejected))
    return Shard(kept, stacked, lost, list(rejected.values()))
