"""Baseline: a bare loop of `mj_step` over the models and states of a vector environment."""

import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.processes import single_threaded
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.shared import private_buffers

STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def random_actions(step: int, rows: int, columns: int) -> Array:
    """Small random actions, the same in every measurement, (rows, columns) float32."""
    return (0.3 * np.random.default_rng(step).normal(size=(rows, columns))).astype(np.float32)


@dataclass
class RecordedSteps:
    """Recorded MuJoCo inputs of environments over some control periods: models, and states with controls and forces."""

    models: list[Any]
    states: Array
    """At the start of each period, (periods, n, size)."""
    substeps: int

    def run(self) -> float:
        """Steps every environment through every period; returns the time in `mj_step` [s]."""
        data = [mujoco.MjData(model) for model in self.models]
        begin = time.perf_counter()
        for states in self.states:
            for model, one, state in zip(self.models, data, states, strict=True):
                mujoco.mj_setState(model, one, state, STATE)
                mujoco.mj_step(model, one, self.substeps)
        both = time.perf_counter()
        for states in self.states:
            for model, one, state in zip(self.models, data, states, strict=True):
                mujoco.mj_setState(model, one, state, STATE)
        return 2.0 * both - begin - time.perf_counter()


def record(setup: Setup, first: int, last: int, periods: int) -> RecordedSteps:
    """Runs environments of one scene from a reset and records their MuJoCo inputs."""
    batch = setup.batch(first, last, private_buffers(setup.buffer_fields(), last - first))
    batch.reset(np.arange(first, last, dtype=np.uint64) + np.uint64(setup.seed))
    (world,) = batch.simulation.worlds
    models = [batch.simulation.physics_model(index)[0] for index in range(batch.n)]
    substeps = round(batch.period / setup.specification.recipe.simulation.physics.timestep)
    states = np.empty((periods, *world.batch.state.shape))
    asked = mujoco.mjtState.mjSTATE_CTRL.value | mujoco.mjtState.mjSTATE_XFRC_APPLIED.value
    data, now = mujoco.MjData(world.model), np.empty(mujoco.mj_stateSize(world.model, asked))
    for period in range(periods):
        batch.buffers["action"][:] = random_actions(period, setup.count, batch.buffers["action"].shape[1])[first:last]
        batch.step()
        states[period] = world.before
        for after, state in zip(world.batch.state, states[period], strict=True):  # add controls and applied forces
            mujoco.mj_setState(world.model, data, after, STATE)
            mujoco.mj_getState(world.model, data, now, asked)
            mujoco.mj_setState(world.model, data, state, STATE)
            mujoco.mj_setState(world.model, data, now, asked)
            mujoco.mj_getState(world.model, data, state, STATE)
    return RecordedSteps(models, states, substeps)


@contextmanager
def bare_loops(setup: Setup, groups: list[tuple[int, int]], periods: int) -> Iterator[Callable[[], float]]:
    """The bare loop in several processes, each with its share of the environments: a function that measures their total
    rate, limited by the slowest [environment steps/s]. Raises BrokenProcessPool if one cannot record its steps."""
    context = get_context("spawn")
    with ExitStack() as stack:
        loops = [
            stack.enter_context(
                ProcessPoolExecutor(1, context, initializer=_prepare, initargs=(setup, first, last, periods))
            )
            for first, last in groups
        ]

        def rate() -> float:
            running = [loop.submit(_run) for loop in loops]
            return setup.count * periods / max(one.result() for one in running)

        with single_threaded():
            rate()
        yield rate


_recorded: RecordedSteps
"""Recorded steps of this worker process of `bare_loops`."""


def _prepare(setup: Setup, first: int, last: int, periods: int) -> None:
    global _recorded
    _recorded = record(setup, first, last, periods)


def _run() -> float:
    return _recorded.run()
