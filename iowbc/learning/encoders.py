"""The student's encoder from a history of observations to a latent, and the estimate of s_priv from it."""

from typing import cast

import torch
from torch import Tensor, nn

from iowbc.learning.perceptron import ACTIVATIONS
from iowbc.learning.symmetric import SymmetricHead
from iowbc.robot.mirror import MirrorMap


class MlpEncoder(nn.Module):
    """Normalised history, (n, K, S), oldest first, to latent, (n, latent): one layer shared by all observations, then
    one layer on all their features."""

    def __init__(self, observation: int, history: int, features: int, latent: int, activation: str) -> None:
        super().__init__()
        activate = ACTIVATIONS[activation].module
        self.frame = nn.Sequential(nn.Linear(observation, features), activate())
        self.whole = nn.Sequential(nn.Linear(history * features, latent), activate())

    def forward(self, history: Tensor) -> Tensor:
        return self.whole(self.frame(history).flatten(1))


class MirroredEncoder(nn.Module):
    """Encoder of half the size, applied to a history and to its mirror image. Mirroring the history therefore swaps
    the halves of the latent."""

    permutation: Tensor
    sign: Tensor

    def __init__(self, encoder: MlpEncoder, mirror: MirrorMap) -> None:
        """`mirror`: of one observation."""
        super().__init__()
        self.encoder = encoder
        self.register_buffer("permutation", torch.from_numpy(mirror.permutation), persistent=False)
        self.register_buffer("sign", torch.from_numpy(mirror.as_float32().sign), persistent=False)

    def forward(self, history: Tensor) -> Tensor:
        first, activate = self.encoder.frame
        assert isinstance(first, nn.Linear)
        # mirror the weights rather than the histories: they are smaller
        mirrored = torch.index_select(first.weight * self.sign, 1, self.permutation)
        both = nn.functional.linear(history, torch.cat([first.weight, mirrored]), first.bias.repeat(2))
        own, image = activate(both).chunk(2, dim=-1)
        return torch.cat([self.encoder.whole(own.flatten(1)), self.encoder.whole(image.flatten(1))], dim=1)


class PrivilegedEstimate(nn.Module):
    """Linear map from the latent to s_priv in the teacher's normalisation; starts at zero, the mean of s_priv."""

    def __init__(self, latent: int, size: int, mirror: MirrorMap | None) -> None:
        """`size`: of s_priv; `mirror`: of s_priv if mirroring swaps the halves of the latent, else None."""
        super().__init__()
        self.symmetric = mirror is not None
        self.head = nn.Linear(latent, size) if mirror is None else SymmetricHead(latent, mirror)
        for parameter in self.head.parameters():
            nn.init.zeros_(parameter)

    def forward(self, latent: Tensor) -> Tensor:
        if not self.symmetric:
            return cast(Tensor, self.head(latent))
        own, image = latent.chunk(2, dim=-1)
        return cast(Tensor, self.head(own + image, own - image))
