"""Messages to a group of environments, wherever it is stepped; each carries itself out."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array
from iowbc.rollouts.rollout_policies import RolloutPolicy
from iowbc.rollouts.trajectories import Trajectories
from iowbc.task.batch import Batch


class Message(Protocol):
    """A message to one group of environments."""

    changes: ClassVar[bool]
    """Whether the environments' future depends on it."""

    def carry_out(self, batch: Batch) -> Any:
        """The answer of the group's batch."""


@dataclass(frozen=True)
class Reset:
    """Begin an episode everywhere; with `seeds`, (n,), all that is random begins anew."""

    seeds: NDArray[np.uint64] | None = None
    changes: ClassVar[bool] = True

    def carry_out(self, batch: Batch) -> None:
        """See `Message`."""
        batch.reset(self.seeds)


@dataclass(frozen=True)
class MakeStep:
    """Make a control step with the actions in the buffers."""

    changes: ClassVar[bool] = True

    def carry_out(self, batch: Batch) -> None:
        """See `Message`."""
        batch.step()


@dataclass(frozen=True)
class Roll:
    """Make a rollout of some control steps."""

    rollout_policy: RolloutPolicy
    steps: int
    changes: ClassVar[bool] = True

    def carry_out(self, batch: Batch) -> Trajectories:
        """See `Message`."""
        return batch.roll(self.rollout_policy, self.steps)


@dataclass(frozen=True)
class Restore:
    """Continue from a snapshot."""

    saved: Mapping[str, Array]
    changes: ClassVar[bool] = True

    def carry_out(self, batch: Batch) -> None:
        """See `Message`."""
        batch.restore(self.saved)


@dataclass(frozen=True)
class SetLevels:
    """Set the curriculum's levels, (n, axes), from the next episodes on."""

    levels: Array
    changes: ClassVar[bool] = True

    def carry_out(self, batch: Batch) -> None:
        """See `Message`."""
        batch.set_levels(self.levels)


@dataclass(frozen=True)
class GetLevels:
    """The curriculum's levels, (n, axes)."""

    changes: ClassVar[bool] = False

    def carry_out(self, batch: Batch) -> Array:
        """See `Message`."""
        return batch.levels()


@dataclass(frozen=True)
class GetDrawn:
    """What was drawn for the current episodes, by name."""

    changes: ClassVar[bool] = False

    def carry_out(self, batch: Batch) -> dict[str, Array]:
        """See `Message`."""
        return batch.drawn()


@dataclass(frozen=True)
class GetSnapshot:
    """Everything that the future depends on."""

    changes: ClassVar[bool] = False

    def carry_out(self, batch: Batch) -> dict[str, Array]:
        """See `Message`."""
        return batch.snapshot()
