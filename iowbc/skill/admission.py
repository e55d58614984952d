"""Admission of transport tasks: a task must need two agents that respond to each other."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import product

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.skill.episodes import ABSENT, CLOCK, Plan, Rule
from iowbc.skill.game import NOMINAL, TransportGame, play_once
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

SOLVED, UNSOLVED = 0.8, 0.2
"""Lowest success rate of the reference pair, and highest of a lone or passive robot."""
MIN_FORCE_RATIO = 1.5
"""Least ratio of the partner force with a passive robot to that of the reference pair at which the passive robot may
succeed. A compliant controller can be led while commanded to stand; only the force shows that it does not help."""
PAIRS: dict[str, tuple[str, Rule]] = {
    "reference": ("path", "lead"),
    "lone robot": (ABSENT, "lead"),
    "passive robot": ("path", "stand"),
    "ignoring": (CLOCK, "clock"),
}
"""Scripted pairs: human and nominal command. The reference pair knows the path and reacts to the object; in the
ignoring pair, each walks the path by the clock at its own pace."""


@dataclass(frozen=True)
class Admission:
    """Results of scripted pairs in a task: means over trials by pair, in the order of `PAIRS`."""

    task: str
    success: dict[str, float]
    reward: dict[str, float]
    force: dict[str, float]
    """90th percentile of the partner's force [N]."""

    @property
    def problems(self) -> tuple[str, ...]:
        """Reasons to reject the task; empty if it is admitted."""
        found = []
        if self.success["reference"] < SOLVED:
            found.append(f"the reference pair solves {self.success['reference']:.0%}, expected {SOLVED:.0%} or more")
        led = self.force["passive robot"] >= MIN_FORCE_RATIO * self.force["reference"]
        for pair in ("lone robot",) if led else ("lone robot", "passive robot"):
            if self.success[pair] > UNSOLVED:
                found.append(f"with a {pair} {self.success[pair]:.0%} succeed, expected {UNSOLVED:.0%} or less")
        if self.reward["ignoring"] >= self.reward["reference"]:
            earned = self.reward["ignoring"]
            found.append(f"a pair that ignores each other earns {earned:.2f}, no less than the reference")
        return tuple(found)


def admissions(
    specification: Specification, student: Student, *, trials: int, workers: int, tasks: Sequence[str] = ()
) -> list[Admission]:
    """Runs every task, or only `tasks`, with each scripted pair: `trials` episodes each, with the same seeds."""
    names = tuple(tasks) or specification.recipe.skill.tasks.names
    plans = [
        Plan(name, human, True, seed=seed, rule=rule)
        for name, (human, rule), seed in product(names, PAIRS.values(), range(trials))
    ]
    with closing(TransportGame(specification, student, n=len(plans), workers=workers, plans=plans)) as game:
        figures = play_once(game, NOMINAL)

    def means(name: str, own: Mask) -> dict[str, float]:
        rows: Array = figures[name][own].astype(np.float64).reshape(len(PAIRS), trials).mean(axis=1)
        return dict(zip(PAIRS, rows.tolist(), strict=True))

    owners = figures["task"]
    return [
        Admission(name, *(means(figure, owners == name) for figure in ("success", "reward", "partner_force_p90")))
        for name in names
    ]
