"""The yardstick: a bare loop of `mj_step` over the models and states of a vector environment, and nothing else."""

import time
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Any, Self

import mujoco
import numpy as np

from iowbc.arrays import Array
from iowbc.processes import single_threaded
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.shared import private_buffers

STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def wander(step: int, rows: int, columns: int) -> Array:
    """Small random actions, the same for whoever measures, (rows, columns) float32."""
    return (0.3 * np.random.default_rng(step).normal(size=(rows, columns))).astype(np.float32)


@dataclass
class RecordedSteps:
    """What environments asked of MuJoCo in some control periods: models, and states with controls and forces."""

    models: list[Any]
    states: Array
    """At the start of each period, (periods, n, size)."""
    substeps: int

    def run(self) -> float:
        """Steps every environment through every period; the time that `mj_step` took [s]."""
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
    """Lets environments of one scene play from a reset and keeps what they asked of MuJoCo."""
    batch = setup.batch(first, last, private_buffers(setup.buffer_fields(), last - first))
    batch.reset(np.arange(first, last, dtype=np.uint64) + np.uint64(setup.seed))
    (world,) = batch.simulation.worlds
    models = [batch.simulation.physics_model(index)[0] for index in range(batch.n)]
    physics = setup.specification.recipe.simulation.physics
    substeps = round(batch.period / physics.timestep)
    states = np.empty((periods, *world.batch.state.shape))
    for period in range(periods):
        batch.buffers["action"][:] = wander(period, setup.count, batch.buffers["action"].shape[1])[first:last]
        batch.step()
        states[period] = world.before
        _with_forces(world, states[period])
    return RecordedSteps(models, states, substeps)


def _with_forces(world: Any, states: Array) -> None:
    """Adds the controls and applied forces of the period to the states at its start."""
    model = world.model
    part = mujoco.mjtState.mjSTATE_CTRL.value | mujoco.mjtState.mjSTATE_XFRC_APPLIED.value
    data = mujoco.MjData(model)
    size = mujoco.mj_stateSize(model, part)
    now = np.empty(size)
    for row, state in zip(world.batch.state, states, strict=True):
        mujoco.mj_setState(model, data, row, STATE)
        mujoco.mj_getState(model, data, now, part)
        mujoco.mj_setState(model, data, state, STATE)
        mujoco.mj_setState(model, data, now, part)
        mujoco.mj_getState(model, data, state, STATE)


def _serve(pipe: Connection, setup: Setup, first: int, last: int, periods: int) -> None:
    recorded = record(setup, first, last, periods)
    recorded.run()
    pipe.send(0.0)
    while pipe.recv():
        pipe.send(recorded.run())


class BareLoops:
    """The bare loop in several processes at once, each over its share of the environments."""

    def __init__(self, setup: Setup, groups: list[tuple[int, int]], periods: int) -> None:
        self._count, self._periods = setup.count, periods
        context = get_context("spawn")
        self._pipes: list[Connection] = []
        self._processes = []
        for first, last in groups:
            ours, theirs = context.Pipe()
            process = context.Process(target=_serve, args=(theirs, setup, first, last, periods), daemon=True)
            with single_threaded():
                process.start()
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        for pipe in self._pipes:
            pipe.recv()

    def rate(self) -> float:
        """Environment steps a second of all processes together, the slowest counting."""
        for pipe in self._pipes:
            pipe.send(True)
        slowest: float = max(pipe.recv() for pipe in self._pipes)
        return self._count * self._periods / slowest

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for pipe in self._pipes:
            pipe.send(False)
        for process in self._processes:
            process.join()
