"""Time of each part of a step of the vector environment."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from iowbc.benchmarks.bare_loop import random_actions
from iowbc.task.batch import Batch
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.worker import Message
from iowbc.task.vector.workers import InProcess, Workers

PARTS = ("physics", "simulation", "references", "reward", "observation", "rest")
"""mj_step; partner, delays, sensors and gathering; commands and references; motion, reward and terminations; writing
observations; signals, counters and the like."""


def _watch(spent: dict[str, float], owner: Any, name: str, label: str) -> None:
    """From now on a method adds its CPU time in this thread, which excludes other programs, to `spent`."""
    method: Callable[..., Any] = getattr(owner, name)

    def timed(*arguments: Any, **options: Any) -> Any:
        begin = time.thread_time()
        found = method(*arguments, **options)
        spent[label] += time.thread_time() - begin
        return found

    setattr(owner, name, timed)


class _BatchWrapper:
    """Wrapper of MuJoCo's batch, which does not accept attributes."""

    def __init__(self, batch: Any) -> None:
        self._batch, self.step, self.forward = batch, batch.step, batch.forward

    def __getattr__(self, name: str) -> Any:
        return getattr(self._batch, name)


def step_breakdown(setup: Setup, periods: int, rounds: int) -> dict[str, float]:
    """CPU time of each part of a step of `setup.count` environments, and additional time at the end of an episode,
    `reset` [ms]: medians over rounds from a reset."""
    workers = InProcess(setup)
    batch, spent = workers.batch, dict.fromkeys(("step", *PARTS[:-1]), 0.0)
    _watch(spent, batch, "step", "step")
    for world in batch.simulation.worlds:
        world.batch = _BatchWrapper(world.batch)
        _watch(spent, world.batch, "step", "physics")
        _watch(spent, world.batch, "forward", "physics")
    _watch(spent, batch.simulation, "step", "simulation")
    _watch(spent, batch.guidance, "advance", "references")
    _watch(spent, batch.judge, "judge", "reward")
    _watch(spent, batch, "_observe", "observation")
    rows: list[dict[str, float]] = []
    for _ in range(rounds):
        batch.reset()
        spent.update(dict.fromkeys(spent, 0.0))
        for period in range(periods):
            workers.buffers["action"][:] = random_actions(period, batch.n, workers.buffers["action"].shape[1])
            batch.step()
        row = {name: 1e3 * seconds / periods for name, seconds in spent.items()}
        row["simulation"] -= row["physics"]
        row["rest"] = row.pop("step") - sum(row.values())
        rows.append(row)
    resets = []
    for index in range(batch.n):
        begin = time.thread_time()
        batch.begin(np.array([index]))
        resets.append(1e3 * (time.thread_time() - begin))
    parts = {name: float(np.median([row[name] for row in rows])) for name in PARTS}
    return parts | {"reset": float(np.median(resets))}


def transfer_time(workers: Workers, rounds: int) -> float:
    """Median time of a worker round trip without work, and of copying the results of a step [ms]."""
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        workers.buffers["action"][:] = 0.0
        workers.call([Message(Batch.levels, changes=False) for _ in workers.groups])
        for name in ("observation", "reward", "done"):
            workers.buffers[name].copy()
        times.append(time.perf_counter() - begin)
    return 1e3 * float(np.median(times))
