"""Second attempts at failed episodes, from their states of one to two periods before the failure."""

from collections.abc import Callable, Mapping

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys, Mask
from iowbc.recipe.task.curriculum import Curriculum

EARLIER = ("older", "newer")
"""Prefixes of the two kept states of each environment; the older one is tried again."""


class Retries:
    """The states of n environments at the last two multiples of `curriculum.retry_period`."""

    def __init__(
        self,
        curriculum: Curriculum,
        period: float,
        state: Callable[[], dict[str, Array]],
        rows: Callable[[Indices], Mapping[str, Indices]],
    ) -> None:
        """`period`: control period [s]; `state`: the complete state by name; `rows`: the rows of some environments,
        ascending, in arrays that have not a row for each, by the beginning of their names."""
        self._chance, self._state, self._rows = curriculum.retry, state, rows
        self._every = max(1, round(curriculum.retry_period / period))
        self._kept: dict[str, dict[str, Array]] = {}

    def keep(self, steps: Indices) -> None:
        """Keeps the states of the environments whose `steps` in their episode, (n,), are a multiple of the period."""
        if self._chance == 0.0:
            return
        state = self._state()
        if not self._kept:
            self._kept = {part: {name: values.copy() for name, values in state.items()} for part in EARLIER}
        which = np.flatnonzero(steps % self._every == 0)
        if len(which):
            older, newer = (self._kept[part] for part in EARLIER)
            for name, rows in self._places(which):
                older[name][rows] = newer[name][rows]
                newer[name][rows] = state[name][rows]

    def chosen(self, failed: Mask, key: Keys, attempt: Indices) -> Indices:
        """Environments whose failed episode is tried again, (k,); `key` of the episode and `attempt` at it, (n,)."""
        which = np.flatnonzero(failed)
        if self._chance == 0.0 or not len(which):
            return which[:0]
        draw = random.uniform(random.absorb(key[which], attempt[which]), "episode/retry", 1)[:, 0]
        same = self._kept["older"]["task/episode_key"][which] == key[which]
        return which[same & (draw < self._chance)]

    def states(self, which: Indices) -> Mapping[str, Array]:
        """Arrays with the states from which environments, (k,), try again; their newer ones are forgotten."""
        older, newer = (self._kept[part] for part in EARLIER)
        for name, rows in self._places(which):
            newer[name][rows] = older[name][rows]
        return older

    def _places(self, which: Indices) -> list[tuple[str, Indices]]:
        """Names of all arrays, with the rows of some environments."""
        parts = self._rows(which)
        names = []
        for name in self._kept["older"]:
            if name.startswith("scene/"):
                beginning = name[: name.index("/", len("scene/")) + 1]
                if beginning in parts:
                    names.append((name, parts[beginning]))
            else:
                names.append((name, which))
        return names

    def arrays(self) -> dict[str, Array]:
        """The kept states by name; none before `keep`."""
        return {f"{part}/{name}": values for part, kept in self._kept.items() for name, values in kept.items()}

    def restore(self, saved: Mapping[str, Array]) -> None:
        """Inverse of `arrays`."""
        for part in EARLIER:
            kept = {name: values for name, values in saved.items() if name.startswith(f"{part}/")}
            if kept:
                self._kept[part] = {name.removeprefix(f"{part}/"): values.copy() for name, values in kept.items()}
