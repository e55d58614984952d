"""The networks of teacher and student, with their observation normalisation inside."""

import itertools
from collections.abc import Sequence
from typing import cast

import torch
from torch import Tensor, nn

ACTIVATIONS: dict[str, type[nn.Module]] = {"elu": nn.ELU, "relu": nn.ReLU, "tanh": nn.Tanh}


def mlp(sizes: Sequence[int], activation: str) -> nn.Sequential:
    """Linear layers of the given sizes with an activation between them; the last one is linear."""
    layers: list[nn.Module] = []
    for inputs, outputs in itertools.pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), ACTIVATIONS[activation]()]
    return nn.Sequential(*layers[:-1])


class Normalizer(nn.Module):
    """(x - mean) / std, clipped; statistics are fixed buffers of shape (size,)."""

    mean: Tensor
    std: Tensor

    def __init__(self, size: int, clip: float) -> None:
        super().__init__()
        self.clip = clip
        self.register_buffer("mean", torch.zeros(size))
        self.register_buffer("std", torch.ones(size))

    def forward(self, x: Tensor) -> Tensor:
        return torch.clamp((x - self.mean) / self.std, -self.clip, self.clip)


class TeacherNetwork(nn.Module):
    """Mean action of the privileged teacher: (s_t, s_priv), shape (n, S + P), to a, shape (n, A)."""

    log_std: Tensor

    def __init__(self, inputs: int, actions: int, hidden: Sequence[int], activation: str, clip: float) -> None:
        super().__init__()
        self.normalizer = Normalizer(inputs, clip)
        self.body = mlp([inputs, *hidden, actions], activation)
        self.register_buffer("log_std", torch.zeros(actions))

    def forward(self, observation: Tensor) -> Tensor:
        return cast(Tensor, self.body(self.normalizer(observation)))


class StudentNetwork(nn.Module):
    """Mean action of the student: the history H_t, shape (n, K, S), oldest first, to a, shape (n, A).

    Each of the K observations is projected by the same layer, the encoder turns all projections into a latent of what
    the load does to the robot, and the body sees that latent beside the newest observation.
    """

    def __init__(
        self,
        observation: int,
        history: int,
        actions: int,
        frame_features: int,
        latent: int,
        hidden: Sequence[int],
        activation: str,
        clip: float,
    ) -> None:
        super().__init__()
        self.normalizer = Normalizer(observation, clip)
        self.frame = nn.Sequential(nn.Linear(observation, frame_features), ACTIVATIONS[activation]())
        self.encoder = nn.Sequential(nn.Linear(history * frame_features, latent), ACTIVATIONS[activation]())
        self.body = mlp([observation + latent, *hidden, actions], activation)

    def forward(self, history: Tensor) -> Tensor:
        normal = self.normalizer(history)
        latent = self.encoder(self.frame(normal).flatten(1))
        return cast(Tensor, self.body(torch.cat([normal[:, -1], latent], dim=1)))
