"""PPO of stable-baselines3 with a rollout and an update of its own: whole arrays, few copies, and a true KL divergence.

Of stable-baselines3 it takes the constructor, saving and loading. What differs: the networks see a sample in a prepared
form that is made once; values of a whole rollout are computed at once; the KL divergence is that of the two Gaussians,
not a sampled estimate, whose heavy tail would starve the step size; no update ends early on it; the standard deviation
has a step size and bounds of its own.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.logger import Logger
from torch import Tensor

from iowbc.learning.as_numpy import acting_policy
from iowbc.learning.gaussian import divergence, entropy, log_density
from iowbc.learning.history_actor import student_architecture
from iowbc.learning.networks import Mirrors, mirror_as_json
from iowbc.learning.normalization import Normalization
from iowbc.learning.policy import ActorCritic
from iowbc.learning.precision import reduced
from iowbc.learning.rollout import Rollout
from iowbc.learning.side_by_side import SideBySide
from iowbc.learning.symmetry import MirroredSamples, half_mirrored
from iowbc.recipe.skill.learning import SkillLearning
from iowbc.recipe.teacher import Teacher
from iowbc.rollouts.blocks import block_size
from iowbc.rollouts.rollout_policies import ExploringPolicy
from iowbc.rollouts.trajectories import Trajectories

FIGURES = ("policy_loss", "value_loss", "kl", "approx_kl", "clip_share")
"""Means over minibatches: of all, and of the last epoch's for the two divergences."""


class Learner(PPO):  # type: ignore[misc]
    """The learner of a recipe on a vector environment with raw observations and rewards. Starts as the reference itself
    (the mean action begins near zero).

    `collect` and `train`, in turn, are an update; stable-baselines3's `learn` has no part in it. What `save` leaves is
    for `PPO.load`.
    """

    policy: ActorCritic
    rollout_buffer: Rollout
    env: Any
    _last_obs: Any
    learning_rate: float

    def __init__(
        self, teacher: Teacher, env: Any, seed: int, mirrors: Mirrors, cores: int, value_only: Sequence[int] = ()
    ) -> None:
        """`mirrors`: of observation and action; `cores`: on which the networks learn; `value_only`: places of an
        observation that the policy does not see."""
        symmetric, student = teacher.symmetry != "none", None
        if teacher.history is not None:
            size = env.observation_space.shape[0] - len(mirrors[0])
            observation = size // (teacher.history.length - 1)
            student = student_architecture(teacher, observation, env.action_space.shape[0], mirrors)
        constructed = [mirror_as_json(mirror) for mirror in mirrors] if teacher.symmetry == "construction" else None
        super().__init__(
            ActorCritic,
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
            seed=seed,
            device="cpu",
            rollout_buffer_class=Rollout,
            policy_kwargs={
                "hidden": list(teacher.hidden),
                "activation": teacher.activation,
                "clip": teacher.normalization_clip,
                "initial_std": teacher.initial_std,
                "std_learning_rate": teacher.std_learning_rate,
                "mirrors": constructed,
                "value_only": list(value_only),
                "student": student,
            },
        )
        self.set_logger(Logger(folder=None, output_formats=[]))
        self.settings, self.side_by_side = teacher, SideBySide(teacher.parts, cores)
        size = len(self.policy.normalizer.mean)
        self.normalization = Normalization(size, self.n_envs, self.gamma, mirrors[0] if symmetric else None)
        self.mirrored = MirroredSamples(mirrors, teacher.mirror_gap) if teacher.symmetry == "augment" else None
        self.seconds = dict.fromkeys(("simulation", "inference", "learning"), 0.0)
        """Time spent since they were last set back [s]."""
        self.caution = 1.0
        """What the desired KL divergence is multiplied by."""
        self.value_alone = 0
        """Environment steps up to which the value network alone learns; the optimiser's moments of the policy follow
        its gradients, its step size is zero."""

    def _excluded_save_params(self) -> list[str]:
        own = ["settings", "normalization", "mirrored", "seconds", "side_by_side", "rollout_buffer"]
        return [*super()._excluded_save_params(), *own]

    @contextmanager
    def _timed(self, part: str) -> Iterator[None]:
        begin = time.perf_counter()
        yield
        self.seconds[part] += time.perf_counter() - begin

    def collect(self) -> None:
        """One rollout into the buffer. The environments make the whole of it themselves; what they saw before it moves
        the normalisation of this one."""
        policy, env = self.policy, self.env
        if self._last_obs is None:
            self._last_obs = env.reset()
        policy.set_training_mode(False)
        self.normalization.frozen = self.num_timesteps >= self.settings.statistics_until
        with self._timed("simulation"), torch.inference_mode():
            self.normalization.move(policy.normalizer)
            noise = torch.randn(self.n_steps, self.n_envs, self.action_space.shape[0]) * torch.exp(policy.log_std)
            rollout_policy = ExploringPolicy(acting_policy(policy), noise.numpy(), block_size(self.n_envs))
            found = env.roll(rollout_policy, self.n_steps)
        self.seconds["simulation"] -= found.acting
        self.seconds["inference"] += found.acting
        self.num_timesteps += self.n_steps * self.n_envs
        self._last_obs = found.observation[-1]
        with self._timed("learning"):
            self._look_back(self.rollout_buffer, found)

    def _look_back(self, rollout: Rollout, found: Trajectories) -> None:
        """What policy and value were during a rollout, and its advantages."""
        columns, shape = rollout.columns, found.reward.shape
        rows = found.observation[:-1].reshape(shape[0] * shape[1], -1)
        prepared = torch.cat(self.side_by_side(self._prepare, torch.from_numpy(rows)))
        columns["observation"].copy_(prepared.view(*shape, -1))
        columns["action"].copy_(torch.from_numpy(found.action))
        self.side_by_side(self._judge, rollout.flat)
        for step, (reward, ended) in enumerate(zip(found.reward, found.ended, strict=True)):
            rollout.rewards[step] = self.normalization.reward(reward, ended)
        rollout.ended[:] = found.ended
        behind = np.concatenate([found.observation[-1], found.cut_observation])
        with torch.inference_mode():
            values = self.policy.predict_values(torch.from_numpy(behind))[:, 0].numpy()
        steps, environments = found.cut.T
        rollout.rewards[steps, environments] += self.gamma * values[self.n_envs :]
        rollout.finish(values[: self.n_envs], self.gamma, self.gae_lambda)
        self.explained = explained_variance(columns["value"], columns["target"])
        self.normalization.observe(self.policy.normalizer.newest(rows))

    def _prepare(self, rows: Tensor) -> Tensor:
        with torch.inference_mode():
            return self.policy.prepared(rows)

    def _judge(self, samples: Tensor) -> None:
        """Writes the policy's mean, the density of the action and the value into rows of samples."""
        policy, own = self.policy, self.rollout_buffer.named(samples)
        with torch.inference_mode():
            with reduced(self.settings.precision):
                hidden = policy.actor.hidden(own["observation"])
            own["mean"].copy_(policy.actor.head(hidden))
            own["log_density"].copy_(log_density(own["action"], own["mean"], policy.log_std))
            own["value"].copy_(policy.critic.head(policy.critic.hidden(own["observation"]))[:, 0])

    def explore_anew(self) -> None:
        """Brings exploration back where the recipe's restart comes before the next update, and only there."""
        restart, passed = self.settings.restart, self.num_timesteps - self.n_steps * self.n_envs
        if restart is not None and passed < restart.after <= self.num_timesteps:
            with torch.no_grad():
                self.policy.log_stds.fill_(float(np.log(restart.std)))

    def train(self) -> None:
        """Gradient steps on the rollout in the buffer."""
        with self._timed("learning"):
            self._train()

    def _train(self) -> None:
        settings, rollout, optimizer = self.settings, self.rollout_buffer, self.policy.optimizer
        self.policy.set_training_mode(True)
        rate = self.learning_rate if self._policy_learns else settings.learning_rate
        moved = float(self._policy_learns)
        rates = (moved * rate, rate, moved * settings.std_learning_rate)
        for group, own in zip(optimizer.param_groups, rates, strict=True):
            group["lr"] = own
        before = self.policy.log_std.detach().clone()
        samples = rollout.flat
        images = None if self.mirrored is None else self.mirrored.images(rollout, self.policy)
        found: list[Tensor] = []
        for _ in range(self.n_epochs):
            shuffled = (samples if images is None else half_mirrored(samples, images))[torch.randperm(len(samples))]
            for batch in torch.split(shuffled, self.batch_size):
                found.append(self._gradient_step(batch, before))
            self._n_updates += 1
        every = torch.stack(found).view(self.n_epochs, -1, len(FIGURES))
        means = dict(zip(FIGURES, every.mean((0, 1)).tolist(), strict=True))
        last = dict(zip(FIGURES, every[-1].mean(0).tolist(), strict=True))
        values = means | {"kl": last["kl"], "approx_kl": last["approx_kl"], "explained_variance": self.explained}
        values |= {"std": float(torch.exp(self.policy.log_std.detach()).mean()), "learning_rate": rate}
        for name, value in values.items():
            self.logger.record(f"train/{name}", value)
        if self._policy_learns:
            self.learning_rate = adapted(rate, last["kl"], settings, self.caution)

    @property
    def _policy_learns(self) -> bool:
        return bool(self.num_timesteps > self.value_alone)

    def _gradient_step(self, batch: Tensor, before: Tensor) -> Tensor:
        """One step of the optimiser on a minibatch of rows; returns `FIGURES`. `before`: log std before the update."""
        policy, size = self.policy, len(batch)
        parameters = [*policy.actor.parameters(), *policy.critic.parameters(), policy.log_stds]
        advantage = self.rollout_buffer.named(batch)["advantage"]
        advantage.sub_(advantage.mean()).div_(advantage.std() + 1e-8)

        def gradient(part: Tensor) -> tuple[tuple[Tensor, ...], Tensor]:
            loss, figures = self._loss(self.rollout_buffer.named(part), before)
            share = len(part) / size
            return torch.autograd.grad(share * loss, parameters), share * figures

        gradients, figures = zip(*self.side_by_side(gradient, batch), strict=True)
        for parameter, *parts in zip(parameters, *gradients, strict=True):
            parameter.grad = torch.stack(parts).sum(0) if len(parts) > 1 else parts[0]
        torch.nn.utils.clip_grad_norm_(parameters, self.max_grad_norm)
        policy.optimizer.step()
        self._bound_deviation()
        return torch.stack(figures).sum(0)

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

    def _bound_deviation(self) -> None:
        """Keeps the standard deviation below its ceiling, which falls with the steps, and above its floor."""
        low, high = deviation_bounds(self.settings, self.num_timesteps)
        with torch.no_grad():
            self.policy.log_stds.clamp_(float(np.log(low)), float(np.log(high)))


def deviation_bounds(teacher: Teacher, steps: int) -> tuple[float, float]:
    """Least and largest standard deviation of the action after some environment steps."""
    restart = teacher.restart
    if restart is not None and steps >= restart.after:
        ceiling = restart.std * 0.5 ** ((steps - restart.after) / restart.half_life)
    elif teacher.std_half_life is None:
        return teacher.std_floor, np.inf
    else:
        ceiling = teacher.initial_std * 0.5 ** (steps / teacher.std_half_life)
    return teacher.std_floor, max(ceiling, teacher.std_end)


def adapted(rate: float, kl: float, settings: Teacher | SkillLearning, caution: float = 1.0) -> float:
    """The next update's step size: a fifth less or more where the KL divergence was far from the desired one.

    `caution`: what the desired divergence is multiplied by.
    """
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
    """Share of the targets' variance that the values foresaw; 1 is all of it, below 0 is worse than their mean."""
    return float(1.0 - (targets - values).var() / (targets.var() + 1e-8))
