"""Planned episodes of the games: task, human and load, and whether the robot knows the path."""

from dataclasses import dataclass
from typing import Literal, get_args

from iowbc.recipe.simulation.partner import BEHAVIOURS

AGENT, ABSENT, CLOCK, PERSON = "agent", "absent", "clock", "person"
KINDS = (*BEHAVIOURS, AGENT, ABSENT, CLOCK, PERSON)
"""Kinds of human: scripted behaviours; the agent, which acts by a policy; nobody; one that walks the path by the clock;
a person, whose hand leads the handle (`GameBatch.hand`)."""
Rule = Literal["lead", "follow", "clock", "stand"]
RULES: tuple[Rule, ...] = get_args(Rule)
"""Nominal commands of the robot: along the path; with the forces on its hands; along the path by the clock, regardless
of the object; standing."""


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
