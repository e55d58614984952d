"""The best state of a training, and rollbacks to it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.errors import StageFailed
from iowbc.learning.checkpoint import Arrays, prefixed, under
from iowbc.recipe.teacher import Check


@dataclass
class Best:
    """Best learner state so far, with rollback to it after a collapse."""

    settings: Check
    learner: Arrays
    """At first the state before the first update."""
    score: float = 0.0
    caution: float = 1.0
    """Factor of the desired KL divergence."""
    rollbacks: int = 0
    """Rollbacks since the last improvement."""
    low: int = 0
    """Number of consecutive scores far below the best."""

    def collapsed(self, score: float) -> bool:
        """True if this is the last of `patience` consecutive scores far below the best."""
        far_below = self.score >= self.settings.notable and score < (1.0 - self.settings.collapse) * self.score
        self.low = self.low + 1 if far_below else 0
        return self.low >= self.settings.patience

    def offer(self, score: float, learner: Arrays) -> None:
        """Keep this learner state if its score equals or exceeds the best."""
        if score >= self.score:
            self.score, self.learner, self.rollbacks = score, learner, 0

    def go_back(self, why: str) -> Arrays:
        """Best learner state; also lowers `caution`. Raises StageFailed after too many rollbacks."""
        self.rollbacks += 1
        if self.rollbacks > self.settings.rollbacks:
            raise StageFailed(
                f"{why}, and all teacher.check.rollbacks ({self.settings.rollbacks}) are used up; lower "
                "teacher.desired_kl or teacher.learning_rate, or raise it"
            )
        self.caution *= self.settings.caution
        self.low = 0
        return self.learner

    def arrays(self) -> Arrays:
        return {
            **prefixed("learner", self.learner),
            "score": np.array([self.score, self.caution]),
            "rollbacks": np.array([self.rollbacks, self.low]),
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self.learner = under("learner", arrays)
        self.score, self.caution = arrays["score"].tolist()
        self.rollbacks, self.low = arrays["rollbacks"].tolist()
