"""Setup of transport games: number, seed, tasks and humans, random keys and shared buffers."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Keys
from iowbc.errors import UsageError, require_known
from iowbc.recipe.skill.skill import Skill
from iowbc.recipe.skill.task import TransportTask
from iowbc.skill import observation as seen
from iowbc.skill.batch import HUMAN_ACTIONS, ROBOT_ACTIONS, GameBatch
from iowbc.skill.episodes import KINDS, Plan
from iowbc.skill.lower_layer import Student
from iowbc.skill.outcomes import FIGURES
from iowbc.task.specification import Specification
from iowbc.task.vector.setup import scene_of
from iowbc.task.vector.shared import Buffers, Fields


@dataclass(frozen=True)
class GameSetup:
    """All games of a `TransportGame`."""

    specification: Specification
    student: Student
    count: int
    seed: int
    partners: tuple[str, ...]
    """Humans to sample in games without a plan."""
    plans: tuple[Plan, ...] | None = None
    """One per game; without plans, tasks and humans are sampled."""

    def __post_init__(self) -> None:
        """Raises UsageError for an unknown task or human, or a wrong number of plans or games."""
        if self.count < 1 or (self.plans is not None and len(self.plans) != self.count):
            found = "no games" if self.plans is None else f"{len(self.plans)} plans for {self.count} games"
            raise UsageError(f"{found}: give each of one or more games its plan")
        for kind in (*self.partners, *(plan.partner for plan in self.plans or ())):
            require_known(kind, "human", KINDS)
        for plan in self.plans or ():
            require_known(plan.task, "transport task", self.skill.tasks.names)

    @property
    def skill(self) -> Skill:
        return self.specification.recipe.skill

    @cached_property
    def tasks(self) -> dict[str, TransportTask]:
        return {name: getattr(self.skill.tasks, name) for name in self.skill.tasks.names}

    @cached_property
    def scenes(self) -> list[str]:
        if self.plans is not None:
            return [self.tasks[plan.task].scene for plan in self.plans]
        weights: dict[str, float] = {}
        for task in self.tasks.values():
            weights[task.scene] = weights.get(task.scene, 0.0) + task.weight
        return scene_of(self.count, weights.items())

    def keys(self, first: int, last: int) -> Keys:
        """Random keys of some games, (k,)."""
        key = random.environment_key(self.seed, np.arange(first, last))
        for row, plan in enumerate(self.plans[first:last] if self.plans is not None else ()):
            if plan.seed is not None:
                key[row] = random.environment_key(plan.seed, np.zeros(1, np.int64))[0]
        return key

    def buffer_fields(self) -> Fields:
        """Buffers that games and learner share."""
        sizes = {f"{time}/{name}": size for time in ("now", "final") for name, size in seen.sizes(self.skill)}
        sizes |= {"action/robot": ROBOT_ACTIONS, "action/human": HUMAN_ACTIONS, "privileged_action": ROBOT_ACTIONS}
        return {
            **{name: ((size,), "float32") for name, size in sizes.items()},
            "reward": ((), "float32"),
            **dict.fromkeys(("terminated", "truncated", "human_acts"), ((), "bool")),
            "figures": ((len(FIGURES),), "float64"),
            "counters": ((1,), "float64"),
        }

    def batch(self, first: int, last: int, buffers: Buffers) -> GameBatch:
        return GameBatch(self, first, last, buffers)
