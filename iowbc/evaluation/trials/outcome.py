"""The outcome of one episode."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iowbc.evaluation.trials.trace import Trace

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Outcome:
    """Signals and end of one episode."""

    trace: Trace
    seconds: float
    """Time until it ended [s]."""
    fallen: bool
    dropped: bool
    finished: bool
    """True where it reached its time limit."""
    drawn: Mapping[str, Array]
    """Everything that was drawn for it, by name, each of shape (k,)."""

    @property
    def survived(self) -> bool:
        """No fall, nothing dropped, for the whole episode."""
        return self.finished and not (self.fallen or self.dropped)

    @property
    def ending(self) -> str:
        """The kind of its end; "diverged" where the simulation broke off without a fall or a drop."""
        if self.fallen:
            return "fell"
        if self.dropped:
            return "dropped"
        return "finished" if self.finished else "diverged"
