"""The student's encoder: a history of observations to a latent, and s_priv as it is read from that."""

from typing import Literal

import torch
from torch import Tensor, nn

from iowbc.learning.activations import ACTIVATIONS
from iowbc.learning.symmetric import SymmetricHead
from iowbc.robot.mirror import MirrorMap

EncoderName = Literal["mlp"]


class MlpEncoder(nn.Module):
    """(n, K, S) normalised, oldest first, to (n, latent): projects each observation by the same layer, and all
    projections by another."""

    def __init__(self, observation: int, history: int, features: int, latent: int, activation: str) -> None:
        super().__init__()
        activate = ACTIVATIONS[activation].module
        self.frame = nn.Sequential(nn.Linear(observation, features), activate())
        self.whole = nn.Sequential(nn.Linear(history * features, latent), activate())

    def forward(self, history: Tensor) -> Tensor:
        return self.whole(self.frame(history).flatten(1))


class MirroredEncoder(nn.Module):
    """An encoder of half the size, of a history and of its mirror image: the halves of the latent are then swapped
    when the history is mirrored."""

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
        # the image's features by mirrored weights: they are smaller than the histories of a batch
        mirrored = torch.index_select(first.weight * self.sign, 1, self.permutation)
        both = nn.functional.linear(history, torch.cat([first.weight, mirrored]), first.bias.repeat(2))
        own, image = activate(both).chunk(2, dim=-1)
        return torch.cat([self.encoder.whole(own.flatten(1)), self.encoder.whole(image.flatten(1))], dim=1)


class PrivilegedEstimate(nn.Module):
    """A linear map from the latent to s_priv in the teacher's normalisation, at first its mean, zero."""

    def __init__(self, latent: int, size: int, mirror: MirrorMap | None) -> None:
        """`size`: of s_priv; `mirror`: its mirror, where that swaps the halves of the latent."""
        super().__init__()
        self.symmetric = mirror is not None
        self.head = nn.Linear(latent, size) if mirror is None else SymmetricHead(latent, mirror)
        for parameter in self.head.parameters():
            nn.init.zeros_(parameter)

    def forward(self, latent: Tensor) -> Tensor:
        estimate: Tensor
        if self.symmetric:
            own, image = latent.chunk(2, dim=-1)
            estimate = self.head(own + image, own - image)
        else:
            estimate = self.head(latent)
        return estimate
