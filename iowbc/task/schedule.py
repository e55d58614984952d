"""Schedules the episodes of each environment: random ones with a curriculum, or planned trials."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, Mask
from iowbc.recipe.task.task import Task
from iowbc.task.curriculum import EpisodeOutcome, difficulty, initial_levels, next_levels, played_levels
from iowbc.task.episode_state import EpisodeState
from iowbc.task.episodes import Episode
from iowbc.task.judge import Ending


class Schedule:
    """Random keys, time limits and levels of n environments."""

    def __init__(
        self, task: Task, memory: EpisodeState, *, environments: Indices, seed: int, trials: Sequence[Episode] | None
    ) -> None:
        """`environments`: global indices, (n,); `trials`: one per environment; None draws episodes at random."""
        n = len(environments)
        self._task, self._memory, self._trials, self._period = task, memory, trials, 1.0 / task.control_frequency
        self.repeats = trials is not None
        """True if a reset begins the same episodes again."""
        self.seeds, self.streams = np.full(n, seed, np.uint64), environments
        if trials is not None:
            self.seeds = np.array([episode.seed for episode in trials], np.uint64)
            self.streams = np.zeros(n, np.int64)
        self.key = random.environment_key(self.seeds, self.streams)
        """Random key of each environment, (n,)."""
        self.episode_key = self.key.copy()
        """Random key of each environment's current episode, (n,)."""
        memory.level[:] = initial_levels(task.curriculum, n) if trials is None else task.curriculum.fixed_level

    @property
    def fixed(self) -> dict[str, Array]:
        """Quantities that each trial holds fixed, by name, (n,); NaN where they are drawn."""
        trials = self._trials or ()
        names = sorted({name for episode in trials for name in episode.fixed})
        return {name: np.array([episode.fixed.get(name, np.nan) for episode in trials]) for name in names}

    def planned(self, part: str) -> list[Any]:
        """A part of the episode that is planned for each environment, such as its script, if it has one."""
        return [None] * len(self.key) if self._trials is None else [getattr(episode, part) for episode in self._trials]

    def reseed(self, seeds: Keys) -> None:
        """Reseeds all random number streams from seeds (n,)."""
        self.key[:] = random.environment_key(seeds, np.zeros(len(seeds), np.int64))

    def start(self, which: Indices) -> Keys:
        """Starts new episodes and returns their keys, (k,)."""
        memory = self._memory
        memory.episode[which] += 1
        key, chance = random.absorb(self.key[which], memory.episode[which]), self._task.curriculum.replay
        if chance > 0.0 and self._trials is None:  # some are the environment's failed episode again
            again = memory.failed[which] & (random.uniform(key, "episode/replay", 1)[:, 0] < chance)
            key = np.where(again, memory.failed_key[which], key)
        self.episode_key[which] = key
        low, high = self._task.episode_duration
        seconds = low + (high - low) * random.uniform(key, "episode/duration", 1)[:, 0]
        if self._trials is not None:
            seconds = np.array([self._trials[index].duration for index in which])
        memory.steps[which], memory.limit[which] = 0, np.maximum(np.round(seconds / self._period), 1)
        standing = random.uniform(key, "episode/standing", 1)[:, 0] < self._task.commands.standing_episodes
        memory.walking[which] = ~standing
        memory.played[which] = played_levels(self._task.curriculum, memory.level[which], ~standing)
        return key

    def scales(self, which: Indices, key: Keys) -> dict[str, Array]:
        """Difficulty scales of new episodes for the simulation, by name, (k,); none for trials."""
        if self._trials is not None:
            return {}
        hardness = difficulty(self._task.curriculum, self._memory.played[which])
        blocked = random.uniform(key, "episode/blocked", 1)[:, 0] < hardness["blocked"]
        return {
            "load_scale": hardness["load"],
            "resistance_scale": np.where(blocked, self._task.curriculum.blocking, hardness["resistance"]),
            "impulse_scale": hardness["disturbance"],
            "push_scale": hardness["disturbance"],
        }

    def causes(self, ending: Ending) -> dict[str, Mask]:
        """Situations of the robots that fall in this step, by name, (n,)."""
        memory = self._memory
        pushed = ending.fallen & (memory.undisturbed * self._period <= self._task.curriculum.blame)
        walking = ending.fallen & memory.stepping & ~pushed
        return {"disturbed": pushed, "walking": walking, "standing": ending.fallen & ~walking & ~pushed}

    def promote(self, ending: Ending, which: Indices) -> None:
        """Updates the levels of environments whose episode ended, (k,), unless it diverged; trials keep theirs."""
        if self._trials is not None:
            return
        memory, curriculum = self._memory, self._task.curriculum
        went = EpisodeOutcome(memory, ending, self._period, curriculum.blame)
        moved = next_levels(curriculum, memory.level, memory.played, went)
        chosen = which[~ending.diverged[which]]
        memory.level[chosen] = moved[chosen]
        lost, same = ending.failed[chosen], memory.failed_key[chosen] == self.episode_key[chosen]
        memory.failed_key[chosen[lost]] = self.episode_key[chosen[lost]]
        memory.failed[chosen] = lost | (memory.failed[chosen] & ~same)
