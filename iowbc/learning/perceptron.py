"""Multilayer perceptrons in the parts in which a learner calls them."""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence

from torch import Tensor, nn

from iowbc.learning.activations import ACTIVATIONS

Hidden = tuple[Tensor, ...]
"""The last hidden layer, in one part or in several."""


class Perceptron(nn.Module, ABC):
    """(..., inputs) to (..., outputs): `head` after `hidden` after `prepare`.

    A learner prepares a sample once and sees it many times; it may compute `hidden` in less precision.
    """

    @abstractmethod
    def prepare(self, x: Tensor) -> Tensor:
        """The input as the first layer takes it, of the same shape."""

    @abstractmethod
    def hidden(self, prepared: Tensor) -> Hidden:
        """The last hidden layer."""

    @abstractmethod
    def head(self, hidden: Hidden) -> Tensor:
        """The output."""

    @abstractmethod
    def initialize(self, gain: float, last: float) -> None:
        """Orthogonal weights: `gain` of the hidden layers, `last` of the output layer; no bias."""

    def forward(self, x: Tensor) -> Tensor:
        return self.head(self.hidden(self.prepare(x)))


def mlp(sizes: Sequence[int], activation: str) -> nn.Sequential:
    """Linear layers of the given sizes with an activation between them; the last one is linear."""
    layers: list[nn.Module] = []
    for inputs, outputs in itertools.pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), ACTIVATIONS[activation].module()]
    return nn.Sequential(*layers[:-1])


class DenseMlp(Perceptron):
    """A perceptron that knows no symmetry."""

    def __init__(self, inputs: int, hidden: Sequence[int], outputs: int, activation: str) -> None:
        super().__init__()
        *layers, self.last = mlp([inputs, *hidden, outputs], activation)
        self.layers = nn.Sequential(*layers)

    def prepare(self, x: Tensor) -> Tensor:
        return x

    def hidden(self, prepared: Tensor) -> Hidden:
        return (self.layers(prepared),)

    def head(self, hidden: Hidden) -> Tensor:
        output: Tensor = self.last(hidden[0].float())
        return output

    def initialize(self, gain: float, last: float) -> None:
        for layer in (*self.layers, self.last):
            if isinstance(layer, nn.Linear):
                nn.init.orthogonal_(layer.weight, last if layer is self.last else gain)
                nn.init.zeros_(layer.bias)
