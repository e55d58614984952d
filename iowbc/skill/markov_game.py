"""The game as a learner sees it."""

from collections.abc import Mapping
from typing import Protocol

from iowbc.arrays import Array, Keys, Mask
from iowbc.skill.game import GameOutcome, Observed

ROBOT, HUMAN = "robot", "human"


class Game(Protocol):
    """n games that are played side by side; see `TransportGame`."""

    n: int
    state_size: int

    @property
    def observation_sizes(self) -> Mapping[str, int]:
        """Of each agent."""

    @property
    def action_sizes(self) -> Mapping[str, int]:
        """Of each agent."""

    @property
    def human_acts(self) -> Mask:
        """Games whose human is that of the actions, (n,)."""

    @property
    def privileged_actions(self) -> Array:
        """What a robot that knew all would do now, (n, actions)."""

    def reset(self, seeds: Keys | None = None, agent_share: float = 0.0) -> Observed:
        """Begin every game anew."""

    def step(self, actions: Mapping[str, Array]) -> GameOutcome:
        """One decision of both agents."""
