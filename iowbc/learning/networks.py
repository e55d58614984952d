"""The networks of teacher and student, with their observation normalisation inside."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.learning.activations import ACTIVATIONS
from iowbc.learning.perceptron import DenseMlp, Perceptron, mlp
from iowbc.learning.symmetric import SymmetricMlp
from iowbc.robot.mirror import MirrorMap

Mirrors = tuple[MirrorMap, MirrorMap]
"""Of an input and of an output."""


def perceptron(
    inputs: int, hidden: Sequence[int], outputs: int, activation: str, mirrors: Mirrors | None
) -> Perceptron:
    """A multilayer perceptron that commutes with the mirrors of its input and output, where they are given."""
    if mirrors is None:
        return DenseMlp(inputs, hidden, outputs, activation)
    return SymmetricMlp(mirrors[0], hidden, mirrors[1], activation)


def mirror_as_json(mirror: MirrorMap) -> dict[str, list[float]]:
    """A mirror as plain values, read back by `mirror_from_json`."""
    return {"permutation": mirror.permutation.tolist(), "sign": np.asarray(mirror.sign).tolist()}


def mirror_from_json(plain: Any) -> MirrorMap:
    """Inverse of `mirror_as_json`."""
    return MirrorMap(np.array(plain["permutation"], np.int64), np.array(plain["sign"], np.float32))


def mirrors_from_json(plain: Any) -> Mirrors | None:
    """Both mirrors of a network's architecture, if it has any."""
    return None if plain is None else (mirror_from_json(plain[0]), mirror_from_json(plain[1]))


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

    def __init__(
        self,
        inputs: int,
        actions: int,
        hidden: Sequence[int],
        activation: str,
        clip: float,
        mirrors: Any = None,
    ) -> None:
        """`mirrors`: of observation and action, as `mirror_as_json` gives them; the network then commutes with them."""
        super().__init__()
        self.normalizer = Normalizer(inputs, clip)
        self.body = perceptron(inputs, hidden, actions, activation, mirrors_from_json(mirrors))
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
        activate = ACTIVATIONS[activation].module
        self.frame = nn.Sequential(nn.Linear(observation, frame_features), activate())
        self.encoder = nn.Sequential(nn.Linear(history * frame_features, latent), activate())
        self.body = mlp([observation + latent, *hidden, actions], activation)

    def forward(self, history: Tensor) -> Tensor:
        normal = self.normalizer(history)
        latent = self.encoder(self.frame(normal).flatten(1))
        return cast(Tensor, self.body(torch.cat([normal[:, -1], latent], dim=1)))
