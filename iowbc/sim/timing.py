"""Relation of physics steps, control periods and the longest latency."""

import numpy as np

from iowbc.arrays import Array


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
