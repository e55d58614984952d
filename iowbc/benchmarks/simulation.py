"""`iowbc bench sim`: the vector environment against a bare loop of `mj_step`, and the time of each part of a step."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from iowbc.benchmarks.bare_loop import bare_loops, random_actions
from iowbc.benchmarks.standing_generator import benchmark_world
from iowbc.processes import available_cores
from iowbc.recipe.recipe import Recipe
from iowbc.task.batch import Batch
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.vector_env import VectorEnv
from iowbc.task.vector.worker import Message
from iowbc.task.vector.workers import InProcess, Workers

PERIODS = 40
"""Measured control steps from a reset: no robot has fallen yet, so that both loops step the same states."""
EPISODE = 10.0
"""Length of an episode [s] over which the cost of a reset is spread."""

PARTS = ("physics", "simulation", "references", "reward", "observation", "rest")
"""mj_step; partner, delays, sensors and gathering; commands and references; motion, reward and terminations; writing
observations; signals, counters and the like."""


def main(
    recipe: Recipe, *, scene: str = "lift", environments: int = 48, workers: Sequence[int] = (), turns: int = 15
) -> dict[str, float]:
    """Measures, prints the tables, returns every figure by name (rates in environment steps a second, times in ms).

    `environments`: per worker; `workers`: counts to measure, by default 1, 2 and the number of cores. The bare loop and
    the vector environment alternate, `turns` times. Rates are of the best repetition, which other programs disturbed
    least; the ratio is the median over repetitions, each of the environment's rate to that of the bare loop before it.
    """
    cores = available_cores()
    counts = sorted(set(workers) or {1, 2, cores})
    with benchmark_world(recipe, scene) as specification:
        recipe = specification.recipe
        print(f"{recipe.name}: scene {scene}, {environments} environments a worker, {cores} cores")
        parts = step_breakdown(Setup(specification, environments, recipe.seed), PERIODS, turns // 2 + 1)
        print(f"{'':34}{'steps/s':>10}{'of bare':>10}")
        figures: dict[str, float] = {}
        for count in counts:
            setup = Setup(specification, count * environments, recipe.seed)
            figures |= _against_bare(setup, count, turns, environments * parts["reset"])
        parts["transfer"] = figures[f"transfer_ms_{counts[-1]}"]
        total = sum(parts[name] for name in (*PARTS, "transfer"))
        print(f"a step of {environments} environments: {total:.2f} ms")
        for name in (*PARTS, "transfer"):
            print(f"  {name:14}{parts[name]:8.3f} ms {100 * parts[name] / total:6.1f} %")
        print(f"  an episode's end adds {parts['reset']:.2f} ms")
        return figures | {f"step_{name}_ms": value for name, value in parts.items()}


def _against_bare(setup: Setup, count: int, turns: int, resets: float) -> dict[str, float]:
    """Rates of the bare loop and of the vector environment, alternately, with `count` processes. `resets`: time in
    which all environments of a worker begin an episode, one after another [ms]."""
    env = VectorEnv(setup.specification, num_envs=setup.count, workers=count, seed=setup.seed)
    try:
        with bare_loops(setup, env.workers.groups, PERIODS) as bare_rate:
            pairs = np.array([(bare_rate(), _rate(env)) for _ in range(turns)])
        transfer = transfer_time(env.workers, 20 * turns)
    finally:
        env.close()
    rates = pairs.max(axis=0)
    ratio = float(np.median(pairs[:, 1] / pairs[:, 0]))
    a_step = 1e-3 * resets / (EPISODE * setup.specification.recipe.task.control_frequency)
    spread = 1.0 / (1.0 + a_step * rates[1] / setup.count)
    print(f"{f'bare mj_step loop, {count} process(es)':34}{rates[0]:10.0f}{1.0:10.2f}")
    print(f"{f'vector environment, {count} worker(s)':34}{rates[1]:10.0f}{ratio:10.2f}")
    print(f"{f'  with a reset every {EPISODE:g} s':34}{rates[1] * spread:10.0f}{ratio * spread:10.2f}")
    return {
        f"bare_{count}": float(rates[0]),
        f"vector_env_{count}": float(rates[1]),
        f"ratio_{count}": ratio,
        f"ratio_with_resets_{count}": ratio * spread,
        f"transfer_ms_{count}": transfer,
    }


def _rate(env: VectorEnv) -> float:
    """Environment steps a second over the first periods of the episodes that the bare loop replays."""
    env.seed(env.setup.seed)
    env.reset()
    given = [random_actions(period, env.num_envs, env.action_space.shape[0]) for period in range(PERIODS)]
    begin = time.perf_counter()
    for action in given:
        env.step(action)
    return float(env.num_envs * PERIODS / (time.perf_counter() - begin))


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
