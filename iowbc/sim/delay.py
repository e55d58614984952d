"""Delay line: past values, read at a latency of any number of periods, also fractional."""

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.sim.timing import require_latency


class DelayLine:
    """The last values of a vector in n environments; each reads with its own latency, interpolated between periods."""

    def __init__(self, n: int, width: int, longest: float) -> None:
        """`longest`: largest latency that can be set [periods]."""
        self._length = int(np.ceil(longest)) + 2
        self._values = np.zeros((self._length, n, width))
        self._newest = np.zeros(1, np.int64)
        self._whole = np.zeros(n, np.int64)
        self._part = np.zeros((n, 1))
        self._flat = self._values.reshape(-1, width)
        self._seen, self._earlier = np.zeros((n, width)), np.zeros((n, width))
        self._places = np.zeros((2, self._length, n), np.intp)
        self._point(np.arange(n))

    def set_latency(self, which: Indices, latency: Array) -> None:
        """Latencies of some environments, (k,) [periods]."""
        require_latency(latency, self._length - 2)
        whole = np.floor(latency)
        self._whole[which], self._part[which, 0] = whole, latency - whole
        self._point(which)

    def _point(self, which: Indices) -> None:
        """Precomputes where some environments read, for every place of the newest value: the value seen and the one
        before it."""
        seen = (np.arange(self._length)[:, None] - self._whole[which]) % self._length
        n = len(self._whole)
        self._places[0][:, which] = seen * n + which
        self._places[1][:, which] = (seen - 1) % self._length * n + which

    def fill(self, which: Indices, value: Array) -> None:
        """Fills the whole history of some environments with `value` (k, width)."""
        self._values[:, which] = value

    def push(self, value: Array) -> None:
        """Adds the newest value, (n, width)."""
        newest = (int(self._newest[0]) + 1) % self._length
        self._newest[0], self._values[newest] = newest, value

    def read(self) -> Array:
        """The values as each environment sees them, (n, width): (1 - f) x[k periods ago] + f x[k + 1 periods ago].

        The array is overwritten by the next call.
        """
        newest = self._newest[0]
        seen = self._flat.take(self._places[0, newest], axis=0, out=self._seen, mode="clip")
        earlier = self._flat.take(self._places[1, newest], axis=0, out=self._earlier, mode="clip")
        earlier -= seen
        earlier *= self._part
        seen += earlier
        return self._seen

    def restored(self) -> None:
        """Must be called after the arrays were overwritten."""
        self._point(np.arange(len(self._whole)))

    def arrays(self) -> dict[str, Array]:
        return {"values": self._values, "newest": self._newest, "whole": self._whole, "part": self._part}
