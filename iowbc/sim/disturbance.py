"""Disturbances at random times: impulses on the object's centre of mass (paper III-D), pushes on the robot's base."""

import numpy as np

from iowbc import counter_random as random
from iowbc.arrays import Array, Indices, Keys
from iowbc.recipe.simulation.randomization import Impulses, Pushes


class Disturbance:
    """Constant forces of a short duration, in n environments; times, sizes and directions from the episode's key."""

    def __init__(self, name: str, settings: Impulses | Pushes, n: int, period: float) -> None:
        """`name`: of the random numbers. Impulses have any direction and a size in N·s; pushes are horizontal, and
        their size is the change of speed, in N·s per unit of `scale`."""
        self._name, self._interval, self._level = name, settings.interval, isinstance(settings, Pushes)
        self._size = settings.speed if isinstance(settings, Pushes) else settings.magnitude
        self._enabled, self._period = settings.enabled, period
        self._length = max(1, round(settings.duration / period))
        self._next, self._until = np.zeros(n, np.int64), np.zeros(n, np.int64)
        self._count = np.zeros(n, np.int64)
        self.force = np.zeros((n, 3))

    def reset(self, which: Indices, key: Keys) -> None:
        """Starts the clocks of some environments; `key` of their episodes, (k,)."""
        self._count[which] = 0
        self._until[which] = 0
        self.force[which] = 0.0
        self._next[which] = self._wait(random.absorb(key, self._count[which]))

    def _wait(self, blow: Keys) -> Indices:
        """Steps to the next disturbance, (k,), from the keys of the last ones; the first has count zero."""
        seconds = random.draw(blow, f"{self._name}/interval", self._interval)[:, 0]
        return np.maximum(np.round(seconds / self._period), self._length).astype(np.int64)

    def advance(self, step: Indices, key: Keys, scale: Array) -> Array:
        """Forces over the period that starts at `step` (n,) of each episode, (n, 3) [N], times `scale` (n,)."""
        if not self._enabled:
            return self.force
        due = step >= self._next
        over = step >= self._until
        over &= self._until > 0
        if over.any():
            self.force[over] = 0.0
            self._until[over] = 0
        if due.any():
            self._start_impulse(np.flatnonzero(due), step, key, scale)
        return self.force

    def _start_impulse(self, which: Indices, step: Indices, key: Keys, scale: Array) -> None:
        self._count[which] += 1
        blow = random.absorb(key[which], self._count[which])
        size = random.draw(blow, f"{self._name}/size", self._size)[:, 0]
        impulse = size * scale[which]
        chance = random.uniform(blow, f"{self._name}/direction", 2)
        turn = 2.0 * np.pi * chance[:, 0]  # evenly over the circle, or the sphere: equal areas in zones of equal height
        rise = np.zeros(len(blow)) if self._level else 2.0 * chance[:, 1] - 1.0
        across = np.sqrt(1.0 - rise * rise)
        direction = np.stack([across * np.cos(turn), across * np.sin(turn), rise], axis=1)
        self.force[which] = direction * (impulse / (self._length * self._period))[:, None]
        self._until[which] = step[which] + self._length
        self._next[which] = step[which] + self._wait(blow)

    def arrays(self) -> dict[str, Array]:
        return {"next": self._next, "until": self._until, "count": self._count, "force": self.force}
