"""Physics steps, control periods and latencies; past values, read at a latency of any number of periods."""

import numpy as np

from iowbc.arrays import Array, Indices


class Timing:
    """Numbers of physics steps in a control period and of past targets to keep."""

    def __init__(self, period: float, timestep: float, longest_latency: int) -> None:
        """`period` of control and `timestep` of physics [s]; `longest_latency` [control periods]."""
        self.period, self.timestep, self.longest_latency = period, timestep, longest_latency
        self.substeps = round(period / timestep)
        if self.substeps < 1 or abs(self.substeps * timestep - period) > 1e-9:
            raise ValueError(
                f"a control period of {period:g} s is no whole number of physics steps of {timestep:g} s; "
                f"choose the time step as {period:g} s divided by a whole number"
            )
        self.kept_targets = self.substeps * longest_latency + 1
        """Number of targets to keep: one per physics step of the longest latency, and the newest."""

    def delay(self, latency: Array) -> Array:
        """Delay of targets in MuJoCo for a latency [control periods], any shape [s]: whole physics steps, less half of
        one, because targets are read by time, and times are rounded."""
        require_latency(latency, self.longest_latency)
        steps = np.round(latency * self.substeps)
        return np.where(steps > 0.0, (steps - 0.5) * self.timestep, 0.0)


def require_latency(latency: Array, longest: int) -> None:
    """Raises ValueError where one of the latencies [control periods] is negative or longer than the longest."""
    if np.any(latency > longest) or np.any(latency < 0.0):
        worst = latency[np.argmax(np.abs(latency))]
        raise ValueError(f"a latency of {worst:g} periods is outside 0 to {longest}; see randomization.longest_latency")


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
