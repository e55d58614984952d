"""What a history of observations becomes: (n, K, S) normalised, oldest first, to a latent, (n, latent)."""

from collections.abc import Callable
from typing import Literal

import torch
from torch import Tensor, nn

from iowbc.learning.activations import ACTIVATIONS
from iowbc.robot.mirror import MirrorMap

EncoderName = Literal["mlp", "conv1d", "gru"]
KERNEL, STRIDE = 5, 2
"""Of the convolutions, in observations; each halves the length."""


class MlpEncoder(nn.Module):
    """Projects each observation by the same layer, and all projections by another."""

    def __init__(self, observation: int, history: int, features: int, latent: int, activation: str) -> None:
        super().__init__()
        activate = ACTIVATIONS[activation].module
        self.frame = nn.Sequential(nn.Linear(observation, features), activate())
        self.whole = nn.Sequential(nn.Linear(history * features, latent), activate())

    def forward(self, history: Tensor) -> Tensor:
        latent: Tensor = self.whole(self.frame(history).flatten(1))
        return latent


class ConvolutionalEncoder(nn.Module):
    """Projects each observation by the same layer, convolves twice along time, and projects what is left."""

    def __init__(self, observation: int, history: int, features: int, latent: int, activation: str) -> None:
        super().__init__()
        activate = ACTIVATIONS[activation].module
        self.frame = nn.Sequential(nn.Linear(observation, features), activate())
        layers: list[nn.Module] = []
        length = history
        for _ in range(2):
            layers += [nn.Conv1d(features, features, KERNEL, STRIDE, padding=KERNEL // 2), activate()]
            length = -(-length // STRIDE)
        self.time = nn.Sequential(*layers)
        self.whole = nn.Sequential(nn.Linear(length * features, latent), activate())

    def forward(self, history: Tensor) -> Tensor:
        latent: Tensor = self.whole(self.time(self.frame(history).transpose(1, 2)).flatten(1))
        return latent


class RecurrentEncoder(nn.Module):
    """Projects each observation by the same layer and reads them in order with a gated recurrent unit."""

    def __init__(self, observation: int, history: int, features: int, latent: int, activation: str) -> None:
        super().__init__()
        del history
        self.frame = nn.Sequential(nn.Linear(observation, features), ACTIVATIONS[activation].module())
        self.time = nn.GRU(features, latent, batch_first=True)

    def forward(self, history: Tensor) -> Tensor:
        every, _ = self.time(self.frame(history))
        last: Tensor = every[:, -1]
        return last


ENCODERS: dict[EncoderName, Callable[[int, int, int, int, str], nn.Module]] = {
    "mlp": MlpEncoder,
    "conv1d": ConvolutionalEncoder,
    "gru": RecurrentEncoder,
}


class MirroredEncoder(nn.Module):
    """Any encoder of half the size, of a history and of its mirror image: the halves of the latent are then swapped
    when the history is mirrored."""

    permutation: Tensor
    sign: Tensor

    def __init__(self, encoder: nn.Module, mirror: MirrorMap) -> None:
        """`mirror`: of one observation."""
        super().__init__()
        self.encoder = encoder
        self.register_buffer("permutation", torch.from_numpy(mirror.permutation), persistent=False)
        self.register_buffer("sign", torch.from_numpy(mirror.as_float32().sign), persistent=False)

    def forward(self, history: Tensor) -> Tensor:
        image = torch.index_select(history, -1, self.permutation) * self.sign
        return torch.cat([self.encoder(history), self.encoder(image)], dim=1)
