"""Multilayer perceptrons in the parts in which a learner calls them."""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence

import torch
from torch import Tensor, nn

from iowbc.learning.activations import ACTIVATIONS

Hidden = tuple[Tensor, ...]
"""The last hidden layer, in one part or in several."""


class Perceptron(nn.Module, ABC):
    """(..., inputs) to (..., outputs): `head` after `hidden` after `prepare`.

    A learner prepares a sample once and sees it many times; it may compute `hidden` in less precision.
    """

    def prepare(self, x: Tensor) -> Tensor:
        """The input as the first layer takes it, of the same shape."""
        return x

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


class VectorPerceptron(Perceptron):
    """A perceptron of a vector, some of whose inputs can be hidden from it."""

    seen: Tensor | None
    """1 for each prepared input that the first layer sees and 0 for the others; None sees all."""

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("seen", None, persistent=False)

    def hide(self, inputs: Sequence[int]) -> None:
        """From now on these inputs decide nothing: they are not seen, and what has learnt without them has no weights
        for them. Raises ValueError where the first layer cannot see one input without another."""
        self.seen, weights = self._without(inputs)
        with torch.no_grad():
            for weight, seen in weights:
                weight *= seen

    @abstractmethod
    def _without(self, inputs: Sequence[int]) -> tuple[Tensor, list[tuple[Tensor, Tensor]]]:
        """1 and 0 for prepared inputs, and for those of each weight of the first layer."""

    def looked_at(self, prepared: Tensor) -> Tensor:
        """Of what was prepared what the first layer sees."""
        return prepared if self.seen is None else prepared * self.seen


def mlp(sizes: Sequence[int], activation: str) -> nn.Sequential:
    """Linear layers of the given sizes with an activation between them; the last one is linear."""
    layers: list[nn.Module] = []
    for inputs, outputs in itertools.pairwise(sizes):
        layers += [nn.Linear(inputs, outputs), ACTIVATIONS[activation].module()]
    return nn.Sequential(*layers[:-1])


class DenseMlp(VectorPerceptron):
    """A perceptron that knows no symmetry."""

    def __init__(self, inputs: int, hidden: Sequence[int], outputs: int, activation: str) -> None:
        super().__init__()
        *layers, self.last = mlp([inputs, *hidden, outputs], activation)
        self.layers = nn.Sequential(*layers)

    def hidden(self, prepared: Tensor) -> Hidden:
        return (self.layers(self.looked_at(prepared)),)

    def _without(self, inputs: Sequence[int]) -> tuple[Tensor, list[tuple[Tensor, Tensor]]]:
        weight = next(self.layers.parameters())
        seen = weight.new_ones(weight.shape[1])
        seen[list(inputs)] = 0.0
        return seen, [(weight, seen)]

    def head(self, hidden: Hidden) -> Tensor:
        return self.last(hidden[0].float())

    def initialize(self, gain: float, last: float) -> None:
        for layer in (*self.layers, self.last):
            if isinstance(layer, nn.Linear):
                nn.init.orthogonal_(layer.weight, last if layer is self.last else gain)
                nn.init.zeros_(layer.bias)
