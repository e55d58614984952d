"""Episodes of the games: task, human and load, and whether the robot knows the path, planned or sampled."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.skill.task import TransportTask

AGENT, ABSENT, CLOCK, PERSON = "agent", "absent", "clock", "person"
KINDS = (*BEHAVIOURS, AGENT, ABSENT, CLOCK, PERSON)
"""Kinds of human: scripted behaviours; the agent, which acts by a policy; nobody; one that walks the path by the clock;
a person, whose hand leads the handle (`GameBatch.hand`)."""
Rule = Literal["lead", "follow", "clock", "stand"]
RULES: tuple[Rule, ...] = get_args(Rule)
"""Nominal commands of the robot: along the path; with the forces on its hands; along the path by the clock, regardless
of the object; standing."""
CLOCK_PACE = (0.5, 1.5)
"""Pace range of a human who ignores the robot; the simulation's leaders walk at most 1.5 times the nominal speed."""
FOLLOWER = BEHAVIOURS.index("follower")
ZERO_FOR_A_PERSON = ("partner_delay", "partner_noise", "partner_share_drift", "start_yaw")
"""Zero for a person: imperfections of scripted humans, and the robot's initial heading in the person's view."""


@dataclass(frozen=True)
class Plan:
    """Fixed quantities of every episode of an environment; the others are sampled."""

    task: str
    partner: str
    """One of `KINDS`."""
    known: bool
    """True if the robot knows the path."""
    mass: float | None = None
    share: float | None = None
    """Object's mass [kg] and the human's share; sampled from the task's ranges if empty."""
    seed: int | None = None
    """Seed of the environment's episodes; if empty, from the game's seed and the environment's number."""
    rule: Rule | None = None
    """Nominal command; if empty, lead if the robot knows the path, else follow."""


class EpisodeDraws:
    """Episodes of n games, sampled from keys or planned."""

    def __init__(
        self,
        tasks: Mapping[str, TransportTask],
        scenes: Sequence[str],
        partners: Sequence[str],
        goal_known: float,
        plans: Sequence[Plan] | None,
    ) -> None:
        """`scenes`, `plans`: one per game; `partners`: humans to sample; `goal_known`: chance to know the path."""
        n, own = len(scenes), list(tasks.values())
        self._goal_known, self._plans, self.agent_share = goal_known, plans, 0.0
        self._kinds = np.array([KINDS.index(kind) for kind in partners])
        chances = np.array([[task.weight * (task.scene == scene) for task in own] for scene in scenes])
        self._tasks = np.cumsum(chances, axis=1) / chances.sum(axis=1, keepdims=True)
        self._mass, self._share = (np.array([getattr(task, name) for task in own]) for name in ("mass", "share"))
        self._resistance = np.array([task.rolling_resistance for task in own], np.float64)
        self.task, self.kind, self.rule = np.zeros((3, n), np.int64)
        """Number of the task, of the human among `KINDS`, of the nominal command among `RULES`, (n,)."""
        self.pace = np.ones(n)
        """Speed of a human who ignores the robot, as a fraction of the nominal speed, (n,)."""
        self.known, self.acts = np.zeros((2, n), np.bool_)
        """True where the robot knows the path; true where the human agent acts, (n,)."""
        if plans is not None:
            self.task[:] = [list(tasks).index(plan.task) for plan in plans]
            self.kind[:] = [KINDS.index(plan.partner) for plan in plans]
            self.known[:] = [plan.known for plan in plans]

    def draw(self, which: Indices, key: Keys) -> dict[str, Array]:
        """Samples the next episodes of some games from keys (k,); values to fix in the simulation, by name, (k,)."""
        chance = random.uniform(key, "game", 6)
        if self._plans is None:
            self.task[which] = (chance[:, :1] >= self._tasks[which]).sum(axis=1)
            scripted = self._kinds[(chance[:, 1] * len(self._kinds)).astype(np.int64)]
            self.kind[which] = np.where(chance[:, 5] < self.agent_share, KINDS.index(AGENT), scripted)
            leads = self.kind[which] != FOLLOWER  # a follower does not reveal the goal
            self.known[which] = (chance[:, 2] < self._goal_known) | ~leads
        task, kind = self.task[which], self.kind[which]
        mass, share = (
            low + (high - low) * chance[:, column]
            for column, (low, high) in ((3, self._mass[task].T), (4, self._share[task].T))
        )
        self.rule[which] = np.where(self.known[which], RULES.index("lead"), RULES.index("follow"))
        if self._plans is not None:
            plans = {row: self._plans[row] for row in which.tolist()}
            held = np.array([[plan.mass, plan.share] for plan in plans.values()], np.float64)
            mass, share = np.where(np.isnan(held.T), (mass, share), held.T)
            asked = {row: plan.rule for row, plan in plans.items() if plan.rule is not None}
            self.rule[[*asked]] = [RULES.index(rule) for rule in asked.values()]
        slow, fast = CLOCK_PACE
        self.pace[which] = slow + (fast - slow) * chance[:, 5]
        self.acts[which] = kind == KINDS.index(AGENT)
        scripted, person = kind < len(BEHAVIOURS), kind == KINDS.index(PERSON)
        return {
            "object_mass": mass,
            "partner_share": np.where(kind == KINDS.index(ABSENT), 0.0, share),
            "partner_behaviour": np.where(scripted, kind, 0).astype(np.float64),
            "partner_pace": np.where(scripted, np.nan, 1.0),
            "object_ground_friction": self._resistance[task],
            **{name: np.where(person, 0.0, np.nan) for name in ZERO_FOR_A_PERSON},
        }
