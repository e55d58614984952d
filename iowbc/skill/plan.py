"""A planned game: task, human and load of one environment's episodes."""

from dataclasses import dataclass
from typing import Literal, get_args

from iowbc.recipe.simulation.partner import BEHAVIOURS

AGENT, ABSENT, CLOCK, PERSON = "agent", "absent", "clock", "person"
KINDS = (*BEHAVIOURS, AGENT, ABSENT, CLOCK, PERSON)
"""Humans: scripted ones with a behaviour; the one of the actions; nobody; one who walks the path by the clock; a person
whose hand leads the handle (`GameBatch.hand`)."""
Rule = Literal["lead", "follow", "clock", "stand"]
RULES: tuple[Rule, ...] = get_args(Rule)
"""Nominal commands of the robot: along the path; with the forces on its hands; along the path by the clock, whatever
the object does; standing."""


@dataclass(frozen=True)
class Plan:
    """What is held in every episode of an environment; all else is drawn."""

    task: str
    """Name of a transport task."""
    partner: str
    """One of `KINDS`."""
    known: bool
    """Whether the robot knows the path."""
    mass: float | None = None
    """Object's mass [kg]; empty draws it from the task's range."""
    share: float | None = None
    """The human's share; empty draws it from the task's range."""
    seed: int | None = None
    """Seed of the environment's episodes; empty takes the game's seed and the environment's number."""
    rule: Rule | None = None
    """Nominal command; empty leads where the robot knows the path and follows where it does not."""
