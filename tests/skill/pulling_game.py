"""The smallest game of a robot and a human: both pull a mass along a line to a place that only the human knows."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array, Keys
from iowbc.skill.game import HUMAN, ROBOT, GameOutcome, Observed

PERIOD, FRICTION, DECISIONS = 0.2, 0.6, 25


class PullingGame:
    """Masses of 1 kg; robot and human pull with up to 1 N each against viscous friction."""

    action_sizes: ClassVar = {ROBOT: 1, HUMAN: 1}
    observation_sizes: ClassVar = {ROBOT: 2, HUMAN: 3}
    state_size = 4

    def __init__(self, n: int) -> None:
        self.n = n

    @property
    def human_acts(self) -> NDArray[np.bool_]:
        return self._human_acts

    @property
    def privileged_actions(self) -> Array:
        return self._script()[:, None].astype(np.float32)

    def _script(self) -> Array:
        """Pull of who knows the goal."""
        pull: Array = np.clip(1.5 * (self.goal - self.place) - self.speed, -1.0, 1.0)
        return pull

    def reset(self, seeds: Keys | None = None, agent_share: float = 0.0) -> Observed:
        self.generator, self.agent_share = np.random.default_rng(seeds), agent_share
        self.place, self.speed, self.force, self.goal, self.total = np.zeros((5, self.n))
        self._human_acts, self.age = np.zeros(self.n, np.bool_), np.zeros(self.n, np.int64)
        self._begin(np.ones(self.n, np.bool_))
        return self.observed()

    def _begin(self, which: NDArray[np.bool_]) -> None:
        count = int(which.sum())
        self.goal[which] = self.generator.choice([-1.0, 1.0], count) * self.generator.uniform(0.5, 1.5, count)
        self._human_acts[which] = self.generator.random(count) < self.agent_share
        for values in (self.place, self.speed, self.force, self.age, self.total):
            values[which] = 0

    def observed(self) -> Observed:
        way = self.goal - self.place
        robot, human = [self.speed, self.force], [way, self.speed, self.force]
        rows: dict[str, list[Array]] = {
            ROBOT: robot,
            HUMAN: human,
            "state": [way, self.speed, self.force, self._human_acts],
        }
        found = {name: np.stack(columns, axis=1).astype(np.float32) for name, columns in rows.items()}
        return Observed({name: found[name] for name in (ROBOT, HUMAN)}, found["state"])

    def step(self, actions: Mapping[str, Array]) -> GameOutcome:
        robot = actions[ROBOT][:, 0].astype(np.float64)
        human = np.where(self._human_acts, actions[HUMAN][:, 0], self._script())
        self.force = human
        self.speed = self.speed + PERIOD * (robot + human - FRICTION * self.speed)
        before, self.place = np.abs(self.goal - self.place), self.place + PERIOD * self.speed
        opposed = np.maximum(0.0, -robot * human)
        reward = (before - np.abs(self.goal - self.place) - 0.05 * opposed - 0.02 * human**2).astype(np.float32)
        self.total += reward
        self.age += 1
        ended = self.age >= DECISIONS
        final = self.observed()
        error = np.abs(self.goal - self.place)
        figures = {"return": self.total[ended], "success": error[ended] < 0.2}
        self._begin(ended)
        none = np.zeros(self.n, np.bool_)
        return GameOutcome(self.observed(), reward, none, ended, final, figures)
