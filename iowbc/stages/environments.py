"""The environments of a training: in worker processes here, or in groups on other machines, with the same rollouts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from iowbc.arrays import Array
from iowbc.pipeline.stage import Job
from iowbc.rollouts.blocks import shares_in_blocks
from iowbc.task.specification import Specification
from iowbc.task.vector.setup import Setup
from iowbc.task.vector.shared import private_buffers
from iowbc.task.vector.vector_env import VectorEnv
from iowbc.task.vector.worker import Message
from iowbc.task.vector.workers import Workers

if TYPE_CHECKING:
    from iowbc.pipeline.cluster.spread import NodeSpread

ACTOR = "rollout actor"
"""Name of a group of environments on another machine."""
WRITTEN = ("action", "counters", "terms")
"""Buffers that the learner also writes: actions, and statistics that it resets after reading."""


def training_environments(job: Job, *, count: int, seed: int, group: int = 1) -> VectorEnv:
    """The environments of a job's recipe, here or on `rollout_actors`; `group`: see `VectorEnv`."""
    world = Specification(job.recipe, job.robot, job.inputs.get("rg-fit"))
    actors = job.recipe.execution.rollout_actors
    workers: int | Callable[[Setup], Workers] = job.workers
    if actors is not None and job.spread is not None:
        workers = partial(RemoteWorkers, job.spread, min(actors, job.spread.width))
    return VectorEnv(world, num_envs=count, workers=workers, seed=seed, group=group)


class RemoteWorkers(Workers):
    """Environments in groups on other machines; what is here is a copy of their buffers after the last request."""

    def __init__(self, spread: "NodeSpread", count: int, setup: Setup) -> None:
        """`count`: number of groups."""
        world = setup.specification
        folders = {"robot": world.robot} | ({} if world.rg is None else {"generator": world.rg})
        self.groups = shares_in_blocks(setup.count, count)
        self.buffers = private_buffers(setup.buffer_fields(), setup.count)
        self._pool = spread.actor_pool(ACTOR, RolloutActor, [(setup, *group) for group in self.groups], folders)
        self._changes = True

    def ask(self, messages: Sequence[Message]) -> None:
        self._changes = messages[0].changes
        written = [
            ({name: self.buffers[name][first:last] for name in WRITTEN}, message)
            for (first, last), message in zip(self.groups, messages, strict=True)
        ]
        self._pool.ask(written, changes=self._changes)

    def answers(self) -> list[Any]:
        found = self._pool.answers()
        if self._changes:
            for group, state in zip(self.groups, self._pool.states, strict=True):
                for name, values in self.buffers.rows(*group).items():
                    values[:] = state[f"buffer/{name}"]
        return found

    def close(self) -> None:
        self._pool.close()


class RolloutActor:
    """A group of environments where it is stepped: a member of an actor pool, see `ActorHost`."""

    def __init__(self, setup: Setup, first: int, last: int, *, robot: Path, generator: Path | None = None) -> None:
        world = Specification(setup.specification.recipe, robot, generator)
        here = replace(setup, specification=world)
        self._batch = here.batch(first, last, private_buffers(here.buffer_fields(), last - first))

    def ask(self, message: tuple[Mapping[str, Array], Message]) -> Any:
        """The answer of the batch. `message`: rows of the buffers in `WRITTEN`, and the message to the batch."""
        written, own = message
        for name, values in written.items():
            self._batch.buffers[name][:] = values
        return own.carry_out(self._batch)

    def state(self) -> dict[str, Any]:
        return self._batch.snapshot()

    def restore(self, state: dict[str, Any]) -> None:
        self._batch.restore(state)
