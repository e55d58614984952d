"""The Markov game of robot and human as the learner sees it: batched, with a shared reward."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
ROBOT, HUMAN = "robot", "human"


@dataclass(frozen=True)
class Observed:
    """What n games show."""

    observations: Mapping[str, Array]
    """Of each agent, (n, k)."""
    state: Array
    """Input of the centralised critic, (n, k)."""


@dataclass(frozen=True)
class Outcome:
    """What a decision of n games leads to."""

    observed: Observed
    """After the games that ended have begun anew."""
    reward: Array
    """Shared, (n,)."""
    terminated: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    final: Observed
    """Before ended games have begun anew."""
    figures: Mapping[str, Array]
    """Of the k episodes that ended, in the order of games, (k,) each."""


class Game(Protocol):
    """n games that are played side by side."""

    n: int
    observation_sizes: Mapping[str, int]
    action_sizes: Mapping[str, int]
    state_size: int

    @property
    def human_acts(self) -> NDArray[np.bool_]:
        """Games whose human is the agent, not a script, (n,)."""

    def reset(self, draw: int, agent_share: float) -> Observed:
        """Begin all games anew. `draw`: number of the draw of everything random; `agent_share`: part of the episodes
        from here on in which the human is the agent."""

    def step(self, actions: Mapping[str, Array]) -> Outcome:
        """One decision of both agents, in [-1, 1]."""
