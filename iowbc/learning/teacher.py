"""The teacher's training, one PPO update at a time (paper III-C)."""

import math
from collections.abc import Mapping
from typing import Any

import torch
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback

from iowbc.errors import StageFailed
from iowbc.learning import ppo
from iowbc.learning.checkpoint import Arrays, prefixed, under
from iowbc.learning.environments import Environments
from iowbc.learning.networks import TeacherNetwork
from iowbc.recipe.teacher import Teacher


class TeacherTraining:
    """PPO with privileged information. Between two updates `arrays` holds all that the rest of it depends on."""

    def __init__(self, settings: Teacher, environments: Environments, mirrors: ppo.Mirrors | None, seed: int) -> None:
        """`mirrors`: of observation and action, for learning from mirror images, too."""
        torch.set_num_threads(1)  # small networks: more gain little, and stall wherever the cores are shared
        self.settings = settings
        self.environments = environments
        self.normalized = ppo.normalize(environments, settings, mirrors)
        self.model = ppo.make_ppo(settings, self.normalized, seed, mirrors)
        self._callback: BaseCallback | None = None

    @property
    def steps(self) -> int:
        """Environment steps made so far."""
        return int(self.model.num_timesteps)

    @property
    def planned(self) -> int:
        """Environment steps after which the training is done; the last update may pass them."""
        return self.settings.steps

    def update(self) -> dict[str, float]:
        """One rollout and its gradient steps; returns the figures of both. Raises StageFailed where they diverge."""
        model = self.model
        if self._callback is None:
            remaining = self.planned - self.steps
            _, self._callback = model._setup_learn(remaining, None, reset_num_timesteps=False)
        model.collect_rollouts(self.normalized, self._callback, model.rollout_buffer, model.n_steps)
        model.train()
        figures = model.logger.name_to_value.items()
        training = {name: float(value) for name, value in figures if name.startswith("train/")}
        if not all(math.isfinite(value) for value in training.values()):
            raise StageFailed(
                f"the networks diverged at {self.steps:,} steps; lower teacher.learning_rate or teacher.largest_kl"
            )
        rate = ppo.adapt_learning_rate(model, self.settings, training["train/approx_kl"])
        return {**self.environments.statistics(), **training, "learning_rate": rate}

    def arrays(self) -> Arrays:
        """Everything that a resumed training needs, between two updates."""
        return {
            **ppo.ppo_arrays(self.model, self.normalized),
            **prefixed("environment", self.environments.state()),
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `arrays`, on a training made from the same recipe."""
        self.environments.restore(under("environment", arrays))
        ppo.restore_ppo(self.model, self.normalized, arrays)

    def network(self) -> tuple[TeacherNetwork, dict[str, Any]]:
        """The deterministic policy with its normalisation, and the arguments that rebuild it."""
        return ppo.teacher_network(self.model, self.normalized, self.settings)
