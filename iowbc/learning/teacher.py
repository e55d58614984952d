"""Teacher training by PPO (paper III-C)."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from iowbc.errors import StageFailed
from iowbc.learning import checkpoint
from iowbc.learning.acting import Policy, policy_of
from iowbc.learning.checkpoint import Arrays, module_arrays, prefixed, under
from iowbc.learning.policy import acting_part, load_policy_weights, trained_network
from iowbc.learning.ppo import Learner
from iowbc.learning.storage import Network
from iowbc.recipe.teacher import Check

FLOOR_REACHED = 1.01
"""A standard deviation within this factor of its floor counts as at the floor."""
COLLAPSED_SHARE = 0.5
"""Reaching a floor below this fraction of `std_end` counts as loss of exploration; a higher floor is intended."""

Score = Callable[[Policy], Mapping[str, float]]
"""Evaluation of a policy: metrics that include `score`, higher is better."""


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


class TeacherTraining:
    """PPO with privileged information. Between two updates, `arrays` is its complete state."""

    def __init__(self, model: Learner, score: Score | None = None, say: Callable[[str], None] = print) -> None:
        """`score`: fixed evaluation that selects the best policy; `say`: receives a message at each rollback."""
        self.model, self.settings, self.environments = model, model.settings, model.env
        self.planned = self.settings.steps
        """Environment steps of the whole training; the last update may exceed them."""
        self.score = score if self.settings.check.every is not None else None
        self.say = say
        self._steps_an_update = self.settings.environments * self.settings.rollout
        self.average: Arrays = {}
        """Exponentially weighted mean of the policies' acting parts; empty unless the recipe wants one."""
        if self.settings.average_half_life is not None:
            self.average = acting_part(module_arrays(self.model.policy))
        self.best = Best(self.settings.check, self._learner_state())

    @property
    def steps(self) -> int:
        """Environment steps made so far."""
        return self.model.steps

    def update(self) -> dict[str, float]:
        """One rollout with its gradient steps and, at the check interval, an evaluation; returns their statistics.
        After a collapse rolls back to the best policy; raises StageFailed after too many rollbacks."""
        model, begin = self.model, time.perf_counter()
        model.seconds = dict.fromkeys(model.seconds, 0.0)
        model.collect()
        training = model.train(self.best.caution)
        if self.settings.average_half_life is not None:
            half_life = self.settings.average_half_life / self._steps_an_update  # in updates
            weight, newest = np.float32(1.0 - 0.5 ** (1.0 / half_life)), acting_part(module_arrays(model.policy))
            self.average = {name: mean + weight * (newest[name] - mean) for name, mean in self.average.items()}
        figures = self.environments.statistics() | self._judged(training)
        seconds = {f"seconds/{part}": spent for part, spent in model.seconds.items()}
        rest = time.perf_counter() - begin - sum(seconds.values())
        return figures | seconds | {"seconds/rest": rest}

    def _judged(self, training: Mapping[str, float]) -> dict[str, float]:
        """Finite statistics of an update and its check; rolls back if they show a collapse."""
        figures = {name: value for name, value in training.items() if np.isfinite(value)}
        deviation, floor = self.model.policy.log_std.detach().exp(), self.settings.std_floor
        updates = self.steps // self._steps_an_update
        why = ""
        if len(figures) < len(training) or not self.model.policy.finite():
            why = "the networks diverged"
        elif float(deviation.mean()) <= FLOOR_REACHED * floor < COLLAPSED_SHARE * self.settings.std_end:
            why = "exploration died out"
        elif self.score is not None and updates % (self.settings.check.every or 1) == 0:
            found = {f"check/{name}": float(value) for name, value in self.score(policy_of(self.network()[0])).items()}
            figures |= found
            if self.best.collapsed(found["check/score"]):
                why = f"the score fell from {self.best.score:.3f} to {found['check/score']:.3f}"
            else:
                self.best.offer(found["check/score"], self._scored())
        if why:
            returns = self.model.normalization.discounted  # of episodes that go on
            self._restore_learner(self.best.go_back(f"{why} at {self.steps:,} steps"))
            self.model.normalization.discounted = returns
            low = 0.0 if self.settings.desired_kl is None else min(self.settings.learning_rate_range)
            self.model.learning_rate = max(low, self.settings.check.caution * self.model.learning_rate)
            self.say(f"{why} at {self.steps:,} steps: goes back to the best policy, with smaller steps")
        return figures | {"rollbacks": float(self.best.rollbacks)}

    def keep_best(self) -> None:
        """End the training: score the last policy, then restore the best learner state."""
        if self.score is not None:
            self.best.offer(float(self.score(policy_of(self.network()[0]))["score"]), self._scored())
            self._restore_learner(self.best.learner)

    def _learner_state(self) -> Arrays:
        """State of the learner: networks, optimiser, normalisation statistics."""
        return {
            **prefixed("policy", module_arrays(self.model.policy)),
            **prefixed("optimizer", checkpoint.optimizer_arrays(self.model.policy.optimizer)),
            **prefixed("normalization", self.model.normalization.arrays()),
        }

    def _acting(self) -> Arrays:
        """Parameters and buffers of the policy; its actor is the running average of policies if there is one."""
        return module_arrays(self.model.policy) | self.average

    def _scored(self) -> Arrays:
        """State of the learner with the policy of `_acting`, which checks score."""
        return {**self._learner_state(), **prefixed("policy", self._acting())}

    def _restore_learner(self, learnt: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `_learner_state`."""
        if self.average:
            self.average = acting_part(under("policy", learnt))
        self.model.former = {}
        checkpoint.restore_module(self.model.policy, under("policy", learnt))
        checkpoint.restore_optimizer(self.model.policy.optimizer, under("optimizer", learnt))
        self.model.normalization.restore(under("normalization", learnt))

    def arrays(self) -> Arrays:
        """Complete state between two updates, for a checkpoint."""
        model = self.model
        assert model.observation is not None, "arrays() comes after an update"
        return {
            **self._learner_state(),
            **prefixed("best", self.best.arrays()),
            "random/torch": torch.get_rng_state().numpy(),
            **prefixed("environment", self.environments.state()),
            "observation": np.array(model.observation),
            "counters": np.array([model.steps]),
            "learning_rate": np.array([model.learning_rate]),
            **prefixed("average", self.average),
            **prefixed("former", model.former),
        }

    def begin(self, network: Network) -> None:
        """Start from a trained policy and keep its normalisation statistics fixed. An adaptive learning rate starts at
        its minimum, since larger steps soon spoil a trained policy. Raises StageFailed for another architecture."""
        model = self.model
        try:
            load_policy_weights(model.policy, network)
        except RuntimeError as error:
            names = "teacher.hidden, activation, symmetry and history (estimate, too)"
            path, _ = self.settings.beginning
            raise StageFailed(f"{path}: that policy's networks are other ones; {names} say which") from error
        model.bound_deviation()
        model.normalization.inherited = network.normalizer.mean.numpy(), network.normalizer.std.numpy()
        model.normalization.move(model.policy.normalizer)
        if self.average:
            self.average = acting_part(module_arrays(model.policy))
        model.value_alone = self.settings.value_first
        if self.settings.desired_kl is not None:
            model.learning_rate = min(self.settings.learning_rate_range)
        self.best = Best(self.settings.check, self._learner_state())

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `arrays`, for a training with the same recipe."""
        model = self.model
        self._restore_learner(arrays)
        if self.average:
            self.average = under("average", arrays)
        self.best.restore(under("best", arrays))
        self.environments.restore(under("environment", arrays))
        model.former = under("former", arrays)
        model.observation = np.array(arrays["observation"])
        model.steps = int(arrays["counters"][0])
        model.learning_rate = float(arrays["learning_rate"][0])
        torch.set_rng_state(torch.from_numpy(np.array(arrays["random/torch"])))

    def network(self) -> tuple[Network, dict[str, Any]]:
        """The deterministic policy with its normalisation, and the arguments that rebuild it."""
        return trained_network(self._acting(), self.settings, self.model.mirrors)
