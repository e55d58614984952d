"""One game as a PettingZoo `ParallelEnv`, for external learners."""

from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from iowbc.arrays import Array
from iowbc.skill.episodes import AGENT, Plan
from iowbc.skill.game import TransportGame
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

Values = dict[str, Any]


class TransportEnv(ParallelEnv):  # type: ignore[misc]
    """Robot and human; both act by default."""

    metadata: ClassVar[Values] = {"name": "iowbc_transport_v0", "is_parallelizable": True, "render_modes": []}

    def __init__(
        self,
        specification: Specification,
        student: Student,
        *,
        plan: Plan | None = None,
        partners: tuple[str, ...] = (AGENT,),
    ) -> None:
        """`plan`: fixed quantities of every episode; without it, tasks and humans (`partners`) are sampled."""
        plans = None if plan is None else (plan,)
        self.game = TransportGame(specification, student, n=1, partners=partners, plans=plans)
        self.possible_agents = list(TransportGame.agents)
        self.agents: list[str] = []
        self.render_mode = None
        self._random = np.random.default_rng()
        self._spaces = {
            agent: (
                spaces.Box(-np.inf, np.inf, (self.game.observation_sizes[agent],), np.float32),
                spaces.Box(-1.0, 1.0, (self.game.action_sizes[agent],), np.float32),
            )
            for agent in self.possible_agents
        }

    def observation_space(self, agent: str) -> spaces.Box:
        return self._spaces[agent][0]

    def action_space(self, agent: str) -> spaces.Box:
        return self._spaces[agent][1]

    def reset(self, seed: int | None = None, options: Values | None = None) -> tuple[dict[str, Array], Values]:
        """Starts an episode: reproducible with a seed, otherwise a new random one."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self.agents = list(self.possible_agents)
        self._seen = self.game.reset(self._random.integers(2**31, size=1, dtype=np.uint64))
        return self._rows(), {agent: {} for agent in self.agents}

    def step(
        self, actions: dict[str, Array]
    ) -> tuple[dict[str, Array], dict[str, float], dict[str, bool], dict[str, bool], Values]:
        out = self.game.step({agent: np.asarray(actions[agent])[None] for agent in self.possible_agents})
        self._seen = out.final
        figures = {name: values[0] for name, values in out.figures.items() if len(values)}
        result = (
            self._rows(),
            dict.fromkeys(self.agents, float(out.reward[0])),
            dict.fromkeys(self.agents, bool(out.terminated[0])),
            dict.fromkeys(self.agents, bool(out.truncated[0])),
            {agent: dict(figures) for agent in self.agents},
        )
        if figures:
            self.agents = []
        return result

    def state(self) -> Array:
        return self._seen.state[0]

    def close(self) -> None:
        self.game.close()

    def _rows(self) -> dict[str, Array]:
        return {agent: self._seen.observations[agent][0] for agent in self.possible_agents}
