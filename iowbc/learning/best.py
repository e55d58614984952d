"""The best policy so far, and when a training is to go back to it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.errors import StageFailed
from iowbc.learning.checkpoint import Arrays, prefixed, under
from iowbc.recipe.teacher import Check


class Best:
    """What a learner was when it scored best, and how cautiously it goes on."""

    def __init__(self, settings: Check, learner: Arrays) -> None:
        """`learner`: everything that it has learnt before the first update."""
        self.settings = settings
        self.learner = learner
        self.score = 0.0
        self.caution = 1.0
        """What the desired KL divergence is multiplied by."""
        self.rollbacks = 0
        """Since the last better policy."""
        self.low = 0
        """Scores in a row that were far below the best."""

    def collapsed(self, score: float) -> bool:
        """Whether this score, after those before, says that the training got lost."""
        far_below = self.score >= self.settings.notable and score < (1.0 - self.settings.collapse) * self.score
        self.low = self.low + 1 if far_below else 0
        return self.low >= self.settings.patience

    def offer(self, score: float, learner: Arrays) -> None:
        """Keeps what has been learnt where it scores at least as well as ever."""
        if score >= self.score:
            self.score, self.learner, self.rollbacks = score, learner, 0

    def go_back(self, why: str) -> Arrays:
        """What the learner was at its best; from now on more cautiously. Raises StageFailed when that did not help."""
        self.rollbacks += 1
        if self.rollbacks > self.settings.rollbacks:
            raise StageFailed(
                f"{why}, for the {self.rollbacks}th time since the best policy; lower teacher.desired_kl or "
                "teacher.learning_rate, or raise teacher.check.rollbacks"
            )
        self.caution *= self.settings.caution
        self.low = 0
        return self.learner

    def arrays(self) -> Arrays:
        """Everything, for a checkpoint."""
        return {
            **prefixed("learner", self.learner),
            "score": np.array([self.score, self.caution]),
            "rollbacks": np.array([self.rollbacks, self.low]),
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `arrays`."""
        self.learner = under("learner", arrays)
        self.score, self.caution = arrays["score"].tolist()
        self.rollbacks, self.low = arrays["rollbacks"].tolist()
