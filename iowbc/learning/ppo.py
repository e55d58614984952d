"""PPO on whole rollouts, with few copies and the exact KL divergence.

The policy class and the saved zip are those of stable-baselines3. Differences from that library's PPO: samples are
prepared once for all epochs; values of a whole rollout are computed at once; the KL divergence is that of the two
Gaussians, not a sampled estimate, whose heavy tail would shrink the learning rate; no update stops early because of the
KL divergence; the standard deviation has its own learning rate and bounds.
"""

import copy
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.utils import set_random_seed
from torch import Tensor

from iowbc.arrays import Array
from iowbc.learning.as_numpy import acting_policy
from iowbc.learning.checkpoint import Arrays, module_arrays, restore_module
from iowbc.learning.computing import ParallelBatch, reduced
from iowbc.learning.environments import Environments
from iowbc.learning.gaussian import divergence, entropy, exploration, log_density
from iowbc.learning.networks import Mirrors, mirrors_as_json, student_architecture
from iowbc.learning.normalization import Normalization
from iowbc.learning.perceptron import Perceptron
from iowbc.learning.policy import ActorCritic, acting_part
from iowbc.learning.rollout import Samples, advantages, drawn_leaders, without_common_part
from iowbc.recipe.skill.learning import SkillLearning
from iowbc.recipe.teacher import Teacher
from iowbc.rollouts.blocks import block_size
from iowbc.rollouts.rollout import ExploringPolicy, Trajectories

FIGURES = ("policy_loss", "value_loss", "kl", "approx_kl", "clip_share")
"""Means over all minibatches; over those of the last epoch for `kl` and `approx_kl`."""


class Learner:
    """PPO learner on a vector environment with raw observations and rewards. One update is `collect`, then `train`. The
    initial mean action is near zero, so that the robot follows the reference."""

    def __init__(
        self,
        teacher: Teacher,
        env: Environments,
        mirrors: Mirrors,
        seed: int,
        *,
        cores: int = 1,
        value_only: Sequence[int] = (),
        device: str = "cpu",
    ) -> None:
        """`mirrors`: of observation and action; `cores`: for network updates, while the environments are idle;
        `value_only`: indices of observations for the value network only; `device`: torch device of the networks."""
        set_random_seed(seed)
        self.settings, self.env, self.mirrors, self.device = teacher, env, mirrors, torch.device(device)
        self._on_cpu = self.device.type == "cpu"
        self.in_parallel = ParallelBatch(teacher.parts if self._on_cpu else 1, cores)
        self._arguments = _policy_arguments(teacher, env, mirrors, value_only)
        self.policy = ActorCritic(
            env.observation_space,
            env.action_space,
            lambda progress: teacher.learning_rate,
            **self._arguments,
        ).to(self.device)
        (inputs,), (actions,) = env.observation_space.shape, env.action_space.shape
        self.samples = Samples(teacher.rollout, env.num_envs, inputs, actions, self.device)
        size, mirror = len(self.policy.normalizer.mean), None if teacher.symmetry == "none" else mirrors[0]
        self.normalization = Normalization(size, env.num_envs, teacher.gamma, mirror)
        self.observation: Array | None = None
        """Rows before the next step; None before the first rollout."""
        self.steps = 0
        """Environment steps made so far."""
        self.learning_rate = teacher.learning_rate
        self.explained = 0.0
        """Explained variance of the value targets of the last rollout."""
        self.former: Arrays = {}
        """Acting part of the policy before the last update; empty before the first one and after a rollback."""
        self.gain: float | None = None
        """Mean normalised advantage that the last update gained, on the rollout after it: an estimate from samples that
        the update has not seen, while -`policy_loss` is one from those that it has. Until `statistics_until` the change
        of the normalisation is part of it."""
        self.seconds = dict.fromkeys(("simulation", "inference", "learning"), 0.0)
        """Time per part since the last reset [s]."""
        self.value_alone = 0
        """Environment steps up to which only the value network learns: the policy's rate is zero, not its moments."""

    def save_for_sb3(self, path: Path) -> None:
        """Write a zip that stable-baselines3's `PPO.load` reads, for users' own code."""
        settings = self.settings
        model = PPO(
            ActorCritic,
            self.env,
            learning_rate=self.learning_rate,
            n_steps=settings.rollout,
            batch_size=self._batch,
            n_epochs=settings.epochs,
            gamma=settings.gamma,
            gae_lambda=settings.gae_lambda,
            clip_range=settings.clip,
            ent_coef=settings.entropy,
            vf_coef=settings.value_weight,
            max_grad_norm=settings.gradient_norm,
            device="cpu",
            policy_kwargs=self._arguments,
        )
        model.policy.load_state_dict(self.policy.state_dict())
        model.policy.optimizer.load_state_dict(self.policy.optimizer.state_dict())
        model.num_timesteps = self.steps
        model.save(path)

    @property
    def _batch(self) -> int:
        return self.settings.environments * self.settings.rollout // self.settings.minibatches

    def collect(self) -> None:
        """Collect one rollout into the samples. Its observations are normalised by statistics of earlier rollouts."""
        policy, env, settings, restart = self.policy, self.env, self.settings, self.settings.restart
        if restart is not None and self.steps - settings.rollout * env.num_envs < restart.after <= self.steps:
            with torch.no_grad():  # once, at the first rollout after the recipe's restart step
                policy.log_stds.fill_(float(np.log(restart.std)))
        if self.observation is None:
            self.observation = env.reset()
        if settings.group > 1:
            leaders = drawn_leaders(env.num_envs, settings.group)
            self.observation = env.copy(leaders)
            self.normalization.discounted = self.normalization.discounted[leaders]
        self.normalization.frozen = self.steps >= settings.statistics_until
        begin = time.perf_counter()
        with torch.inference_mode():
            self.normalization.move(policy.normalizer)
            acting = policy if self._on_cpu else copy.deepcopy(policy).cpu()
            noise = exploration((settings.rollout, env.num_envs), acting.log_std, settings.noise_correlation)
            rollout_policy = ExploringPolicy(acting_policy(acting), noise.numpy(), block_size(env.num_envs))
            found = env.roll(rollout_policy, settings.rollout)
        rolled = time.perf_counter()
        self.seconds["simulation"] += rolled - begin - found.acting
        self.seconds["inference"] += found.acting
        self.steps += settings.rollout * env.num_envs
        self.observation = found.observation[-1]
        self._process_rollout(found)
        self.seconds["learning"] += time.perf_counter() - rolled

    def _process_rollout(self, found: Trajectories) -> None:
        """Add the policy's outputs, values and advantages of a rollout to the samples."""
        samples, settings, shape = self.samples, self.settings, found.reward.shape
        columns = samples.columns
        rows = found.observation[:-1].reshape(shape[0] * shape[1], -1)
        prepared = torch.cat(self.in_parallel(self._prepare, self._tensor(rows)))
        columns["observation"].copy_(prepared.view(*shape, -1))
        columns["action"].copy_(self._tensor(found.action))
        self.in_parallel(self._judge, samples.flat)
        steps = zip(found.reward, found.ended, strict=True)
        rewards = np.stack([self.normalization.reward(reward, ended) for reward, ended in steps])
        behind = np.concatenate([found.observation[-1], found.cut_observation])
        with torch.inference_mode():
            values = self.policy.predict_values(self._tensor(behind))[:, 0].cpu().numpy()
        cut_steps, environments = found.cut.T
        rewards[cut_steps, environments] += settings.gamma * values[shape[1] :]
        value = columns["value"].cpu().numpy()
        last = values[: shape[1]]
        advantage = advantages(rewards, found.ended, value, last, settings.gamma, settings.gae_lambda)
        columns["target"].copy_(torch.from_numpy(advantage + value))
        self.explained = explained_variance(columns["value"], columns["target"])
        if settings.group > 1:
            advantage = without_common_part(advantage, found.ended, settings.group)
        columns["advantage"].copy_(torch.from_numpy(advantage))
        self.gain = self._gain() if self.former else None
        self.normalization.observe(rows[:, self.policy.newest])

    def _tensor(self, values: Array) -> Tensor:
        return torch.from_numpy(values).to(self.device)

    def _prepare(self, rows: Tensor) -> Tensor:
        """Rows, (n, S), as inputs of both networks: normalised, in their mirror basis."""
        with torch.inference_mode():
            return self.policy.actor.prepare(self.policy.normalizer(rows))

    def _judge(self, samples: Tensor) -> None:
        """Write the policy's mean, the log density of the action and the value into rows of samples."""
        policy, own = self.policy, self.samples.named(samples)
        with torch.inference_mode():
            own["mean"].copy_(self._mean(policy.actor, own))
            own["log_density"].copy_(log_density(own["action"], own["mean"], policy.log_std))
            own["value"].copy_(policy.critic.head(policy.critic.hidden(own["observation"]))[:, 0])

    def _gain(self) -> float:
        """Mean normalised advantage of the samples by which the policy betters the former one."""
        former = copy.deepcopy(self.policy)
        restore_module(former, module_arrays(former) | self.former)

        def ratio(samples: Tensor) -> Tensor:
            own = self.samples.named(samples)
            with torch.inference_mode():
                density = log_density(own["action"], self._mean(former.actor, own), former.log_std)
                return torch.exp(density - own["log_density"])

        advantage = self.samples.columns["advantage"].flatten()
        normal = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
        return float((normal * (1.0 - torch.cat(self.in_parallel(ratio, self.samples.flat)))).mean())

    def _mean(self, actor: Perceptron, samples: dict[str, Tensor]) -> Tensor:
        with reduced(self.settings.precision):
            hidden = actor.hidden(samples["observation"])
        return actor.head(hidden)

    def train(self, caution: float) -> dict[str, float]:
        """Gradient steps on the samples; returns their statistics. `caution`: factor of the desired KL divergence."""
        settings, optimizer, begin = self.settings, self.policy.optimizer, time.perf_counter()
        rate = self.learning_rate if self._policy_learns else settings.learning_rate
        moved = float(self._policy_learns)
        rates = (moved * rate, rate, moved * settings.std_learning_rate)
        for group, own in zip(optimizer.param_groups, rates, strict=True):
            group["lr"] = own
        before = self.policy.log_std.detach().clone()
        self.former = acting_part(module_arrays(self.policy))
        samples = self.samples.flat
        found: list[Tensor] = []
        for _ in range(settings.epochs):
            shuffled = torch.index_select(samples, 0, torch.randperm(len(samples)).to(self.device))
            found += [self._gradient_step(batch, before) for batch in torch.split(shuffled, self._batch)]
        every = torch.stack(found).view(settings.epochs, -1, len(FIGURES))
        means = dict(zip(FIGURES, every.mean((0, 1)).tolist(), strict=True))
        last = dict(zip(FIGURES, every[-1].mean(0).tolist(), strict=True))
        values = means | {"kl": last["kl"], "approx_kl": last["approx_kl"], "explained_variance": self.explained}
        values |= {} if self.gain is None else {"gain": self.gain}
        values |= {"std": float(torch.exp(self.policy.log_std.detach()).mean()), "learning_rate": rate}
        if self._policy_learns:
            self.learning_rate = adapted(rate, last["kl"], settings, caution)
        self.seconds["learning"] += time.perf_counter() - begin
        return {f"train/{name}": value for name, value in values.items()}

    @property
    def _policy_learns(self) -> bool:
        return self.steps > self.value_alone

    def _gradient_step(self, batch: Tensor, before: Tensor) -> Tensor:
        """One optimiser step on a minibatch of rows, in the bounds of the std; returns `FIGURES`. `before`: log std."""
        policy, size = self.policy, len(batch)
        parameters = [*policy.actor.parameters(), *policy.critic.parameters(), policy.log_stds]
        advantage = self.samples.named(batch)["advantage"]
        advantage.sub_(advantage.mean()).div_(advantage.std() + 1e-8)

        def gradient(part: Tensor) -> tuple[tuple[Tensor, ...], Tensor]:
            loss, figures = self._loss(self.samples.named(part), before)
            share = len(part) / size
            return torch.autograd.grad(share * loss, parameters), share * figures

        gradients, figures = zip(*self.in_parallel(gradient, batch), strict=True)
        for parameter, *parts in zip(parameters, *gradients, strict=True):
            parameter.grad = torch.stack(parts).sum(0) if len(parts) > 1 else parts[0]
        torch.nn.utils.clip_grad_norm_(parameters, self.settings.gradient_norm)
        policy.optimizer.step()
        self.bound_deviation()
        return torch.stack(figures).sum(0)

    def bound_deviation(self) -> None:
        """Clip the standard deviation to its bounds."""
        low, high = deviation_bounds(self.settings, self.steps)
        with torch.no_grad():
            self.policy.log_stds.clamp_(float(np.log(low)), float(np.log(high)))

    def _loss(self, samples: dict[str, Tensor], before: Tensor) -> tuple[Tensor, Tensor]:
        """The loss of samples, and `FIGURES`; their advantages are normalised."""
        policy, settings, advantage = self.policy, self.settings, samples["advantage"]
        with reduced(settings.precision):
            acting, judging = policy.actor.hidden(samples["observation"]), policy.critic.hidden(samples["observation"])
        mean, value, log_std = policy.actor.head(acting), policy.critic.head(judging)[:, 0], policy.log_std
        difference = log_density(samples["action"], mean, log_std) - samples["log_density"]
        ratio = torch.exp(difference)
        clipped = torch.clamp(ratio, 1.0 - settings.clip, 1.0 + settings.clip)
        policy_loss = -torch.min(advantage * ratio, advantage * clipped).mean()
        value_loss = torch.nn.functional.mse_loss(value, samples["target"])
        loss = policy_loss + settings.value_weight * value_loss - settings.entropy * entropy(log_std)
        with torch.no_grad():
            kl = divergence(samples["mean"], before, mean, log_std).mean()
            sampled = (ratio - 1.0 - difference).mean()
            share = ((ratio - 1.0).abs() > settings.clip).float().mean()
            figures = torch.stack([policy_loss, value_loss, kl, sampled, share])
        return loss, figures


def _policy_arguments(teacher: Teacher, env: Any, mirrors: Mirrors, value_only: Sequence[int]) -> dict[str, Any]:
    """Arguments of `ActorCritic` other than its spaces and learning rate."""
    student = None
    if teacher.history is not None:
        size = env.observation_space.shape[0] - len(mirrors[0])
        observation = size // (teacher.history.length - 1)
        student = student_architecture(teacher, observation, env.action_space.shape[0], mirrors)
    return {
        "hidden": list(teacher.hidden),
        "activation": teacher.activation,
        "clip": teacher.normalization_clip,
        "initial_std": teacher.initial_std,
        "std_learning_rate": teacher.std_learning_rate,
        "mirrors": mirrors_as_json(mirrors, teacher.symmetry),
        "value_only": list(value_only),
        "student": student,
    }


def deviation_bounds(teacher: Teacher, steps: int) -> tuple[float, float]:
    """Bounds of the action's standard deviation after `steps` environment steps: a floor, and a ceiling that decays."""
    restart = teacher.restart
    if restart is not None and steps >= restart.after:
        ceiling = restart.std * 0.5 ** ((steps - restart.after) / restart.half_life)
    elif teacher.std_half_life is None:
        return teacher.std_floor, np.inf
    else:
        ceiling = teacher.initial_std * 0.5 ** (steps / teacher.std_half_life)
    return teacher.std_floor, max(ceiling, teacher.std_end)


def adapted(rate: float, kl: float, settings: Teacher | SkillLearning, caution: float = 1.0) -> float:
    """Learning rate of the next update: 20 % lower or higher if the KL divergence is over or under the desired one by
    more than a factor of 1.5, within `learning_rate_range`. `caution`: factor of the desired divergence."""
    if settings.desired_kl is None:
        return rate
    desired = caution * settings.desired_kl
    if kl > 1.5 * desired:
        rate *= 0.8
    elif kl < desired / 1.5:
        rate *= 1.2
    low, high = settings.learning_rate_range
    return min(max(rate, low), high)


def explained_variance(values: Tensor, targets: Tensor) -> float:
    """Fraction of the targets' variance explained by the values: 1 is perfect, below 0 is worse than their mean."""
    return float(1.0 - (targets - values).var() / (targets.var() + 1e-8))
