"""Policy and value network as a stable-baselines3 policy, on rows (s_t, s_priv) or (H_t, s_priv); its conversion to a
deployable network, and back."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn

from iowbc.learning.checkpoint import Arrays, under
from iowbc.learning.gaussian import log_density, std_places
from iowbc.learning.networks import (
    Mirrors,
    Normalizer,
    StudentNetwork,
    TeacherNetwork,
    mirrors_as_json,
    mirrors_from_json,
    perceptron,
    student_architecture,
)
from iowbc.learning.perceptron import Hidden, Perceptron, VectorPerceptron
from iowbc.learning.storage import Network
from iowbc.recipe.teacher import Teacher
from iowbc.robot.mirror import MirrorMap

INVARIANT = MirrorMap(np.zeros(1, np.int64), np.ones(1, np.float32))
"""Mirror of the value: a state and its mirror image have the same value."""
HIDDEN_GAIN, POLICY_GAIN, VALUE_GAIN = float(np.sqrt(2.0)), 0.01, 1.0
"""Gains of the initial orthogonal weights, as in stable-baselines3. The policy starts close to the reference."""
ACTS = ("actor.", "log_stds")
"""Name prefixes of the arrays of an `ActorCritic` that determine its actions."""


class HistoryNormalizer(Normalizer):
    """Normalisation of rows (H_t, s_priv) by the statistics of (s_t, s_priv), equal for all steps of a history."""

    def __init__(self, size: int, clip: float, observation: int, length: int) -> None:
        """`size`: of (s_t, s_priv); `observation`: of s_t; `length`: observations in a history."""
        super().__init__(size, clip)
        places = torch.arange(size)
        self._places = torch.cat([places[:observation].repeat(length - 1), places])

    def forward(self, x: Tensor) -> Tensor:
        mean, std = self.mean[self._places], self.std[self._places]
        return (x - mean).div_(std).clamp_(-self.clip, self.clip)


class HistoryActor(Perceptron):
    """The student's network without its input normalisation."""

    def __init__(self, architecture: Mapping[str, Any]) -> None:
        super().__init__()
        self.network = StudentNetwork(**architecture)

    def hidden(self, prepared: Tensor) -> Hidden:
        network, flat = self.network, prepared.reshape(-1, prepared.shape[-1])
        frames = flat[:, : network.history * network.observation].reshape(-1, network.history, network.observation)
        both = torch.cat([frames[:, -1], network.body_context(network.encoder(frames))], dim=1)
        parts = network.body.hidden(network.body.prepare(both))
        return tuple(part.reshape(*prepared.shape[:-1], -1) for part in parts)

    def head(self, hidden: Hidden) -> Tensor:
        return self.network.body.head(hidden)

    def initialize(self, gain: float, last: float) -> None:
        self.network.body.initialize(gain, last)


class NewestCritic(Perceptron):
    """Critic of (s_t, s_priv) alone: s_priv contains what the actor must infer from the history."""

    def __init__(self, critic: Perceptron, newest: slice) -> None:
        """`newest`: place of (s_t, s_priv) in a row."""
        super().__init__()
        self.critic, self._newest = critic, newest

    def hidden(self, prepared: Tensor) -> Hidden:
        return self.critic.hidden(self.critic.prepare(prepared[..., self._newest]))

    def head(self, hidden: Hidden) -> Tensor:
        return self.critic.head(hidden)

    def initialize(self, gain: float, last: float) -> None:
        self.critic.initialize(gain, last)


class ActorCritic(ActorCriticPolicy):  # type: ignore[misc]
    """Gaussian policy and value function with separate networks and built-in normalisation of observations.

    With mirrors, both commute with them: the mean is mirrored with the observation, the standard deviation is equal on
    both sides, and the value is unchanged. With a student's architecture, the policy is the student's network on rows
    of H_t followed by s_priv; the value network receives the newest (s_t, s_priv).
    """

    def __init__(
        self,
        observation_space: Any,
        action_space: Any,
        lr_schedule: Any,
        *,
        hidden: Sequence[int],
        activation: str,
        clip: float,
        initial_std: float,
        std_learning_rate: float,
        mirrors: Any = None,
        value_only: Sequence[int] = (),
        student: Mapping[str, Any] | None = None,
        use_sde: bool = False,
    ) -> None:
        """`mirrors`: as in `TeacherNetwork`; `value_only`: indices of observations for the value network only;
        `student`: arguments of `StudentNetwork`, which receives none of s_priv."""
        super().__init__(observation_space, action_space, lr_schedule, net_arch=[], use_sde=use_sde)
        (inputs,), (actions,) = observation_space.shape, action_space.shape
        both = mirrors_from_json(mirrors)
        value = None if both is None else (both[0], INVARIANT)
        self.normalizer: Normalizer
        self.actor: Perceptron
        self.critic: Perceptron
        self.newest = slice(0, None)
        """Place of (s_t, s_priv) in a row."""
        if student is None:
            self.normalizer = Normalizer(inputs, clip)
            self.actor = perceptron(inputs, hidden, actions, activation, both)
            self.critic = perceptron(inputs, hidden, 1, activation, value)
        else:
            length, observation = student["history"], student["observation"]
            self.newest = slice((length - 1) * observation, None)
            size = inputs - self.newest.start
            self.normalizer = HistoryNormalizer(size, clip, observation, length)
            self.actor = HistoryActor(student)
            self.critic = NewestCritic(perceptron(size, hidden, 1, activation, value), self.newest)
        self.actor.initialize(HIDDEN_GAIN, POLICY_GAIN)
        self.critic.initialize(HIDDEN_GAIN, VALUE_GAIN)
        self._value_only = tuple(value_only)
        self.hide()
        place = std_places(actions, None if both is None else both[1])
        self.log_stds = nn.Parameter(torch.full((place.max() + 1,), float(np.log(initial_std))))
        """One per pair of actions that the mirror swaps, and one per remaining action."""
        self.register_buffer("std_place", torch.from_numpy(place), persistent=False)
        rate = lr_schedule(1)
        self.optimizer = torch.optim.Adam(
            [
                {"params": list(self.actor.parameters()), "lr": rate},
                {"params": list(self.critic.parameters()), "lr": rate},
                {"params": [self.log_stds], "lr": std_learning_rate},
            ],
            eps=1e-5,
            fused=True,
        )

    def _build(self, lr_schedule: Any) -> None:
        """Build none of stable-baselines3's own networks."""

    def hide(self) -> None:
        """Mask the `value_only` inputs of a policy on s_t and s_priv."""
        if self._value_only and isinstance(self.actor, VectorPerceptron):
            self.actor.hide(self._value_only)

    @property
    def log_std(self) -> Tensor:
        """Logarithm of the standard deviation, (A,)."""
        return self.log_stds[self.std_place]

    def finite(self) -> bool:
        return all(bool(torch.isfinite(parameter).all()) for parameter in self.parameters())

    def forward(self, obs: Tensor, deterministic: bool = False) -> tuple[Tensor, Tensor, Tensor]:
        mean, log_std = self._mean(obs), self.log_std
        actions = mean if deterministic else mean + torch.randn_like(mean) * torch.exp(log_std)
        return actions, self.predict_values(obs), log_density(actions, mean, log_std)

    def evaluate_actions(self, obs: Tensor, actions: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        distribution = self.get_distribution(obs)
        return self.predict_values(obs), distribution.log_prob(actions), distribution.entropy()

    def get_distribution(self, obs: Tensor) -> Any:
        return self.action_dist.proba_distribution(self._mean(obs), self.log_std)

    def predict_values(self, obs: Tensor) -> Tensor:
        return self.critic(self.normalizer(obs))

    def _mean(self, obs: Tensor) -> Tensor:
        return self.actor(self.normalizer(obs))


def acting_part(arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    """Arrays of an `ActorCritic` that determine its actions."""
    return {name: value for name, value in arrays.items() if name.startswith(ACTS)}


def trained_network(
    policy: Mapping[str, NDArray[Any]], settings: Teacher, mirrors: Mirrors
) -> tuple[Network, dict[str, Any]]:
    """Network of the mean action of an `ActorCritic` with these parameters and buffers, including normalisation, and
    the arguments that rebuild it. `mirrors`: of a row (s_t, s_priv) and of an action."""
    arrays = {name: torch.from_numpy(np.array(value)) for name, value in policy.items()}
    mean, std = arrays["normalizer.mean"], arrays["normalizer.std"]
    actions = len(mirrors[1])
    network: Network
    with torch.random.fork_rng(devices=()):
        if settings.history is None:
            architecture = {
                "inputs": len(mean),
                "actions": actions,
                "hidden": list(settings.hidden),
                "activation": settings.activation,
                "clip": settings.normalization_clip,
                "mirrors": mirrors_as_json(mirrors, settings.symmetry),
            }
            network = TeacherNetwork(**architecture)
            network.body.load_state_dict(under("actor", arrays, "."))
        else:
            seen = len(arrays["actor.network.normalizer.mean"])
            architecture = student_architecture(settings, seen, actions, mirrors)
            network = StudentNetwork(**architecture)
            network.load_state_dict(under("actor.network", arrays, "."))
            mean, std = mean[:seen], std[:seen]
    network.normalizer.mean.copy_(mean)
    network.normalizer.std.copy_(std)
    symmetric = settings.symmetry == "construction"
    network.log_std.copy_(arrays["log_stds"][torch.from_numpy(std_places(actions, mirrors[1] if symmetric else None))])
    network.requires_grad_(False)
    return network.eval(), architecture


def load_policy_weights(policy: ActorCritic, network: Network) -> None:
    """Load a trained network's mean action and standard deviation into a PPO policy; its value network is unchanged.
    Raises RuntimeError if the networks have different architectures."""
    learnt = network.state_dict() if isinstance(network, StudentNetwork) else network.body.state_dict()
    actor = policy.actor.network if isinstance(policy.actor, HistoryActor) else policy.actor
    actor.load_state_dict(learnt)
    policy.hide()
    with torch.no_grad():
        policy.log_stds[policy.std_place] = network.log_std.to(policy.log_stds.device)
