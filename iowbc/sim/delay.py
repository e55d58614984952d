"""Delay line: past values, read at a latency of any number of periods, also fractional."""

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.sim.timing import require_latency


class DelayLine:
    """The last values of a vector in n environments; each reads with its own latency, interpolated between periods."""

    def __init__(self, n: int, width: int, longest: float) -> None:
        """`longest`: largest latency that can be set [periods]."""
        self._values = np.zeros((int(np.ceil(longest)) + 2, n, width))
        """The newest value, then the past ones, the oldest first: the value of k periods ago is at index -k."""
        self._rows = np.arange(n)
        self._whole = np.zeros(n, np.int64)
        self._part = np.zeros((n, 1))

    def set_latency(self, which: Indices, latency: Array) -> None:
        """Latencies of some environments, (k,) [periods]."""
        require_latency(latency, len(self._values) - 2)
        whole = np.floor(latency)
        self._whole[which], self._part[which, 0] = whole, latency - whole

    def fill(self, which: Indices, value: Array) -> None:
        """Fills the whole history of some environments with `value` (k, width)."""
        self._values[:, which] = value

    def push(self, value: Array) -> None:
        """Adds the newest value, (n, width)."""
        values = self._values
        values[1:-1] = values[2:]
        values[-1], values[0] = values[0], value

    def read(self) -> Array:
        """The values as each environment sees them, (n, width): (1 - f) x[k periods ago] + f x[k + 1 periods ago]."""
        seen = self._values[-self._whole, self._rows]
        earlier = self._values[-self._whole - 1, self._rows]
        earlier -= seen
        earlier *= self._part
        seen += earlier
        return seen

    def arrays(self) -> dict[str, Array]:
        return {"values": self._values, "whole": self._whole, "part": self._part}
