"""Setup from which a process builds its part of the environments."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from iowbc.robot.description import load_robot
from iowbc.rollouts.blocks import block_size
from iowbc.task.batch import Batch
from iowbc.task.episodes import Episode
from iowbc.task.layout import full_layout
from iowbc.task.record.signals import signal_sizes
from iowbc.task.record.statistics import COUNTERS
from iowbc.task.rewards.reward import term_names
from iowbc.task.specification import Specification
from iowbc.task.vector.shared import Buffers, Fields


@dataclass(frozen=True)
class Setup:
    """All environments of a vector environment."""

    specification: Specification
    count: int
    seed: int
    episodes: tuple[Episode, ...] | None = None
    """Episode of each environment; None draws episodes as in training."""
    group: int = 1
    """Environments of a group follow one another, share a scene and are stepped by the same process."""

    def __post_init__(self) -> None:
        if self.count < 1:
            raise ValueError(f"a vector environment has at least one environment, got {self.count}")
        if self.episodes is not None and len(self.episodes) != self.count:
            raise ValueError(f"{len(self.episodes)} episodes for {self.count} environments: give one to each")
        if block_size(self.count) % self.group or self.count % self.group:
            raise ValueError(f"{self.count} environments do not form groups of {self.group}")

    @property
    def scenes(self) -> list[str]:
        if self.episodes is not None:
            return [episode.scene for episode in self.episodes]
        scenes = scene_of(self.count // self.group, self.specification.recipe.task.scenes)
        return [name for name in scenes for _ in range(self.group)]

    def buffer_fields(self) -> Fields:
        """Arrays exchanged between the environments and the learner."""
        recipe, robot = self.specification.recipe, load_robot(self.specification.robot)
        observation, support, public = full_layout(recipe, robot).size, len(robot.support), self.specification.public
        action = support + (len(robot.interaction) if public is not None and public.moves_arms else 0)
        signals = signal_sizes(robot, planned=self.episodes is not None)
        return {
            "action": ((action,), "float32"),
            "observation": ((observation,), "float32"),
            "terminal_observation": ((observation,), "float32"),
            "reward": ((), "float32"),
            "done": ((), "bool"),
            "truncated": ((), "bool"),
            "episode_return": ((), "float64"),
            "episode_length": ((), "int64"),
            "counters": ((len(COUNTERS),), "float64"),
            "terms": ((len(term_names(recipe.task.reward)),), "float64"),
            **{f"signal/{name}": ((size,), "float64") for name, size in signals.items()},
        }

    def batch(self, first: int, last: int, buffers: Buffers) -> Batch:
        """The environments from `first` to `last`, the latter excluded."""
        return Batch(self, first, last, buffers)


def scene_of(count: int, shares: Iterable[tuple[str, float]]) -> list[str]:
    """Scene of each of `count` environments, in given shares rounded to whole environments, one scene after another:
    most worker processes then hold one scene alone, and their arrays are copied as a block."""
    names, given = zip(*shares, strict=True)
    weights = np.array(given)
    wanted = count * weights / weights.sum()
    whole = np.floor(wanted + 1e-9).astype(int)
    short = np.argsort(-(wanted - whole), kind="stable")[: count - whole.sum()]
    whole[short] += 1
    return [name for name, number in zip(names, whole.tolist(), strict=True) for _ in range(number)]
