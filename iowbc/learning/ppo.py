"""PPO of stable-baselines3 as the recipe sets it up, its complete state, and the network it leaves behind."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.logger import Logger
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from iowbc.learning import checkpoint
from iowbc.learning.networks import ACTIVATIONS, TeacherNetwork
from iowbc.learning.symmetry import MirroredRolloutBuffer, SymmetricMeanStd
from iowbc.recipe.teacher import Teacher
from iowbc.robot.mirror import MirrorMap

VARIANCE_FLOOR = 1e-4
"""Added to variances: an input that hardly moves in training is not blown up when it does."""


Mirrors = tuple[MirrorMap, MirrorMap]
"""Of the observation and of the action."""


SB3_KL_MARGIN = 1.5
"""PPO of stable-baselines3 ends an update beyond this many times its `target_kl`."""


def normalize(env: VecEnv, teacher: Teacher, mirrors: Mirrors | None) -> VecNormalize:
    """Normalise observations and rewards of `env` by running statistics."""
    normalized = VecNormalize(env, gamma=teacher.gamma, clip_obs=teacher.normalization_clip, epsilon=VARIANCE_FLOOR)
    if mirrors is not None:
        normalized.obs_rms = SymmetricMeanStd(mirrors[0])
    return normalized


def make_ppo(teacher: Teacher, env: VecNormalize, seed: int, mirrors: Mirrors | None) -> PPO:
    """PPO with the recipe's numbers; starts as the reference itself (the mean action begins near zero)."""
    buffer: dict[str, Any] = {"rollout_buffer_class": RolloutBuffer}
    if mirrors is not None:
        arguments = {"observation_mirror": mirrors[0], "action_mirror": mirrors[1]}
        buffer = {"rollout_buffer_class": MirroredRolloutBuffer, "rollout_buffer_kwargs": arguments}
    hidden = list(teacher.hidden)
    model = PPO(
        "MlpPolicy",
        env,
        learning_rate=teacher.learning_rate,
        n_steps=teacher.rollout,
        batch_size=teacher.environments * teacher.rollout // teacher.minibatches,
        n_epochs=teacher.epochs,
        gamma=teacher.gamma,
        gae_lambda=teacher.gae_lambda,
        clip_range=teacher.clip,
        ent_coef=teacher.entropy,
        vf_coef=teacher.value_weight,
        max_grad_norm=teacher.gradient_norm,
        target_kl=teacher.largest_kl / SB3_KL_MARGIN if teacher.largest_kl else None,
        seed=seed,
        device="cpu",
        policy_kwargs={
            "net_arch": {"pi": hidden, "vf": hidden},
            "activation_fn": ACTIVATIONS[teacher.activation],
            "log_std_init": float(np.log(teacher.initial_std)),
        },
        **buffer,
    )
    if isinstance(model.rollout_buffer, MirroredRolloutBuffer):
        model.rollout_buffer.policy = model.policy
    model.set_logger(Logger(folder=None, output_formats=[]))
    return model


def adapt_learning_rate(model: PPO, teacher: Teacher, kl: float) -> float:
    """Move the step size of the next update towards the desired KL divergence; returns it."""
    rate = float(model.learning_rate)
    if teacher.desired_kl is not None:
        if kl > 1.5 * teacher.desired_kl:
            rate *= 0.8
        elif kl < teacher.desired_kl / 1.5:
            rate *= 1.2
        low, high = teacher.learning_rate_range
        set_learning_rate(model, min(max(rate, low), high))
    return float(model.learning_rate)


def set_learning_rate(model: PPO, rate: float) -> None:
    """Use a step size from the next update on."""
    model.learning_rate = rate
    model._setup_lr_schedule()


def ppo_arrays(model: PPO, env: VecNormalize) -> checkpoint.Arrays:
    """Networks, optimiser, normalisation, last observation and random states, between two rollouts."""
    assert model._last_obs is not None
    assert model._last_episode_starts is not None
    return {
        **checkpoint.prefixed("policy", checkpoint.module_arrays(model.policy)),
        **checkpoint.prefixed("optimizer", checkpoint.optimizer_arrays(model.policy.optimizer)),
        **checkpoint.prefixed("random", checkpoint.random_arrays()),
        **{f"normalization/observation_{name}": value for name, value in _moments(env.obs_rms).items()},
        **{f"normalization/return_{name}": value for name, value in _moments(env.ret_rms).items()},
        "normalization/returns": env.returns,
        "last/observation": np.asarray(model._last_obs),
        "last/episode_starts": np.asarray(model._last_episode_starts),
        "counters": np.array([model.num_timesteps, model._n_updates]),
        "learning_rate": np.array([model.learning_rate]),
    }


def restore_ppo(model: PPO, env: VecNormalize, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Inverse of `ppo_arrays`, on a model made from the same recipe."""
    checkpoint.restore_module(model.policy, checkpoint.under("policy", arrays))
    checkpoint.restore_optimizer(model.policy.optimizer, checkpoint.under("optimizer", arrays))
    for statistics, name in ((env.obs_rms, "observation"), (env.ret_rms, "return")):
        statistics.mean = np.array(arrays[f"normalization/{name}_mean"])
        statistics.var = np.array(arrays[f"normalization/{name}_var"])
        statistics.count = float(arrays[f"normalization/{name}_count"][0])
    env.returns = np.array(arrays["normalization/returns"])
    model._last_obs = np.array(arrays["last/observation"])
    model._last_episode_starts = np.array(arrays["last/episode_starts"])
    model.num_timesteps, model._n_updates = (int(value) for value in arrays["counters"])
    set_learning_rate(model, float(arrays["learning_rate"][0]))
    checkpoint.restore_random(checkpoint.under("random", arrays))


def _moments(statistics: Any) -> checkpoint.Arrays:
    return {
        "mean": np.asarray(statistics.mean),
        "var": np.asarray(statistics.var),
        "count": np.array([statistics.count], np.float64),
    }


def teacher_network(model: PPO, env: VecNormalize, teacher: Teacher) -> tuple[TeacherNetwork, dict[str, Any]]:
    """The deterministic policy with its normalisation, and the arguments that rebuild it."""
    (inputs,), (actions,) = env.observation_space.shape, env.action_space.shape
    architecture: dict[str, Any] = {
        "inputs": int(inputs),
        "actions": int(actions),
        "hidden": list(teacher.hidden),
        "activation": teacher.activation,
        "clip": teacher.normalization_clip,
    }
    network = TeacherNetwork(**architecture)
    source = [*model.policy.mlp_extractor.policy_net, model.policy.action_net]
    for target, layer in zip(network.body, source, strict=True):
        target.load_state_dict(layer.state_dict())
    network.normalizer.mean.copy_(torch.from_numpy(env.obs_rms.mean))
    network.normalizer.std.copy_(torch.from_numpy(np.sqrt(env.obs_rms.var + VARIANCE_FLOOR)))
    network.log_std.copy_(model.policy.log_std.detach())
    return network.requires_grad_(False), architecture
