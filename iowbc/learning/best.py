"""Policies that a training keeps beside the newest: the best so far, and a running mean."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import nn

from iowbc.errors import StageFailed
from iowbc.learning.checkpoint import Arrays, module_arrays, prefixed, under
from iowbc.recipe.teacher import Check

ACTS = ("actor.", "log_stds")
"""Name prefixes of the arrays of an `ActorCritic` that determine its actions."""


class Best:
    """Best learner state so far, with rollback to it after a collapse."""

    def __init__(self, settings: Check, learner: Arrays) -> None:
        """`learner`: state before the first update."""
        self.settings = settings
        self.learner = learner
        self.score = 0.0
        self.caution = 1.0
        """Factor of the desired KL divergence."""
        self.rollbacks = 0
        """Rollbacks since the last improvement."""
        self.low = 0
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
        """State for a checkpoint."""
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


def averaged(means: Arrays, policy: nn.Module, half_life: float) -> Arrays:
    """Exponentially weighted means of the acting parts of policies, updated with the newest one. `half_life`: number of
    updates after which the weight of a policy has halved."""
    newest, weight = acting_part(module_arrays(policy)), np.float32(1.0 - 0.5 ** (1.0 / half_life))
    return {name: mean + weight * (newest[name] - mean) for name, mean in means.items()}


def acting_part(arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    """Arrays of an `ActorCritic` that determine its actions."""
    return {name: value for name, value in arrays.items() if name.startswith(ACTS)}
