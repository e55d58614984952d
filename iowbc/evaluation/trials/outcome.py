"""Outcome of one episode."""

from collections.abc import Mapping
from dataclasses import dataclass

from iowbc.arrays import Array
from iowbc.task.record.signals import Trace


@dataclass(frozen=True)
class Outcome:
    """Signals and termination of one episode."""

    trace: Trace
    seconds: float
    """Duration until the end [s]."""
    fallen: bool
    dropped: bool
    finished: bool
    """True if the episode reached its time limit."""
    drawn: Mapping[str, Array]
    """Random draws by name, each of shape (k,)."""

    @property
    def survived(self) -> bool:
        return self.finished and not (self.fallen or self.dropped)

    @property
    def ending(self) -> str:
        """Kind of termination; "diverged" if the simulation stopped without a fall or a drop."""
        if self.fallen:
            return "fell"
        if self.dropped:
            return "dropped"
        return "finished" if self.finished else "diverged"
