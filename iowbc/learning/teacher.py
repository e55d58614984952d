"""The teacher's training, one PPO update at a time (paper III-C)."""

import math
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback

from iowbc.errors import StageFailed
from iowbc.learning import checkpoint
from iowbc.learning.checkpoint import Arrays, prefixed, under
from iowbc.learning.environments import Environments
from iowbc.learning.networks import Mirrors, TeacherNetwork
from iowbc.learning.ppo import make_learner
from iowbc.processes import keep_freed_memory
from iowbc.recipe.teacher import Teacher


class TeacherTraining:
    """PPO with privileged information. Between two updates `arrays` holds all that the rest of it depends on."""

    def __init__(
        self, settings: Teacher, environments: Environments, mirrors: Mirrors, seed: int, cores: int = 1
    ) -> None:
        """`mirrors`: of observation and action; `cores`: on which the networks learn while the environments rest."""
        torch.set_num_threads(1)
        keep_freed_memory()
        self.settings = settings
        self.environments = environments
        self.model = make_learner(settings, environments, seed, mirrors, cores)
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
        model, begin = self.model, time.perf_counter()
        model.seconds = dict.fromkeys(model.seconds, 0.0)
        if self._callback is None:
            _, self._callback = model._setup_learn(self.planned - self.steps, None, reset_num_timesteps=False)
        model.collect_rollouts(self.environments, self._callback, model.rollout_buffer, model.n_steps)
        model.train()
        training = {name: float(value) for name, value in model.logger.name_to_value.items()}
        if not all(map(math.isfinite, training.values())):
            raise StageFailed(f"the networks diverged at {self.steps:,} steps; lower teacher.learning_rate")
        seconds = {f"seconds/{part}": spent for part, spent in model.seconds.items()}
        rest = time.perf_counter() - begin - sum(seconds.values())
        return {**self.environments.statistics(), **training, **seconds, "seconds/rest": rest}

    def arrays(self) -> Arrays:
        """Everything that a resumed training needs, between two updates."""
        model = self.model
        assert model._last_obs is not None, "arrays() comes after an update"
        return {
            **prefixed("policy", checkpoint.module_arrays(model.policy)),
            **prefixed("optimizer", checkpoint.optimizer_arrays(model.policy.optimizer)),
            **prefixed("normalization", model.normalization.arrays()),
            **prefixed("random", checkpoint.random_arrays()),
            **prefixed("environment", self.environments.state()),
            "observation": np.array(model._last_obs),
            "counters": np.array([model.num_timesteps, model._n_updates]),
            "learning_rate": np.array([model.learning_rate]),
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `arrays`, on a training made from the same recipe."""
        model = self.model
        checkpoint.restore_module(model.policy, under("policy", arrays))
        checkpoint.restore_optimizer(model.policy.optimizer, under("optimizer", arrays))
        model.normalization.restore(under("normalization", arrays))
        self.environments.restore(under("environment", arrays))
        model._last_obs = np.array(arrays["observation"])
        model.num_timesteps, model._n_updates = (int(value) for value in arrays["counters"])
        model.learning_rate = float(arrays["learning_rate"][0])
        checkpoint.restore_random(under("random", arrays))

    def network(self) -> tuple[TeacherNetwork, dict[str, Any]]:
        """The deterministic policy with its normalisation, and the arguments that rebuild it."""
        policy, own = self.model.policy, self.model.policy_kwargs
        (inputs,), (actions,) = self.model.observation_space.shape, self.model.action_space.shape
        shared = {name: own[name] for name in ("hidden", "activation", "clip", "mirrors")}
        architecture = {"inputs": int(inputs), "actions": int(actions), **shared}
        network = TeacherNetwork(**architecture)
        network.normalizer.load_state_dict(policy.normalizer.state_dict())
        network.body.load_state_dict(policy.actor.state_dict())
        network.log_std.copy_(policy.log_std.detach())
        return network.requires_grad_(False), architecture
