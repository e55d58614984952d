"""A stretch of an episode that was taken down, and what it says of how well the command was followed."""

from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from iowbc.evaluation.trials.errors import ERRORS, deviations_from_clamped
from iowbc.evaluation.trials.interaction import load_metrics
from iowbc.evaluation.trials.rollout import RECORDED, trace_of
from iowbc.live.moment import Moment
from iowbc.recipe.evaluation.success import Success

WINDOW = 3.0
"""Figures are means over so long a time [s]; the weight in the hands leaves out its first second."""


@dataclass(frozen=True)
class Readings:
    """Figures of the seconds before a moment; NaN where there is nothing to measure."""

    errors: dict[str, float]
    """The paper's four, by `ERRORS`, against the command as clamped."""
    weight_in_hands: float
    """The hands' part of what the robot carries of the object's weight."""
    saturated: dict[str, float]
    """Part of the time at the torque limit, of the joints that ever were."""


@dataclass
class Track:
    """The moments of one episode, one a control step."""

    title: str
    model: Any
    """As it is drawn."""
    period: float
    """Control period [s]."""
    gait_period: float
    """Over which v_sys is averaged [s]."""
    held_weight: float
    """Of the object in the hands [N]; 0 without one."""
    joints: tuple[str, ...]
    kept: int | None = None
    """So many of the last moments are kept; None keeps all."""
    ending: str = ""
    """How the episode ended, once it has."""
    moments: deque[Moment] = field(init=False)

    def __post_init__(self) -> None:
        self.moments = deque(maxlen=self.kept)

    @property
    def start(self) -> float:
        """Time of the first moment that is kept [s]."""
        return self.moments[0].seconds

    @property
    def end(self) -> float:
        """Time of the last one [s]."""
        return self.moments[-1].seconds

    def place(self, seconds: float) -> int:
        """Index of the moment at a time [s], or of the nearest one."""
        return int(np.clip(round((seconds - self.start) / self.period), 0, len(self.moments) - 1))

    def readings(self, place: int) -> Readings:
        """The figures at the moment of an index."""
        first = max(0, place + 1 - round(WINDOW / self.period))
        seen = [self.moments[index] for index in range(first, place + 1)]
        signals = {name: np.stack([moment.signals[name] for moment in seen])[:, None] for name in RECORDED}
        trace = trace_of(signals, 0, len(seen), self.period)
        deviations = deviations_from_clamped(trace, max(1, round(self.gait_period / self.period)))
        shares = trace.joint_saturation.mean(axis=0)
        means = deviations.means()
        return Readings(
            errors={name: means[name] for name in ERRORS},
            weight_in_hands=load_metrics(trace, self.held_weight, Success().least_weight)["weight_in_hands"],
            saturated={name: float(share) for name, share in zip(self.joints, shares, strict=True) if share > 0},
        )
