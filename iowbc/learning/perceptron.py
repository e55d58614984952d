"""Multilayer perceptrons, split into the parts that a learner calls, and their activations."""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn

aten = torch.ops.aten

Hidden = tuple[Tensor, ...]
"""The last hidden layer, in one part or in several."""


class Activation(NamedTuple):
    """An activation whose derivative follows from its value."""

    module: type[nn.Module]
    function: Callable[[Tensor], Tensor]
    backward: Callable[[Tensor, Tensor], Tensor]
    """Gradient at the input, from the gradient at the output and the output value."""


ACTIVATIONS = {
    "elu": Activation(nn.ELU, nn.functional.elu, lambda grad, y: aten.elu_backward(grad, 1, 1, 1, True, y)),
    "relu": Activation(nn.ReLU, torch.relu, lambda grad, y: aten.threshold_backward(grad, y, 0)),
    "tanh": Activation(nn.Tanh, torch.tanh, lambda grad, y: aten.tanh_backward(grad, y)),
}
"""Activations by their name in a recipe."""


class Perceptron(nn.Module, ABC):
    """(..., inputs) to (..., outputs): `prepare`, then `hidden`, then `head`. A learner prepares a sample once and uses
    it many times; it may compute `hidden` in reduced precision."""

    def prepare(self, x: Tensor) -> Tensor:
        """Input of the first layer, in the shape of `x`."""
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
    """Perceptron of a vector whose inputs can be masked."""

    seen: Tensor | None
    """Mask of the prepared inputs: 1 for those that the first layer receives, else 0. None: no mask."""

    def __init__(self) -> None:
        super().__init__()
        self.register_buffer("seen", None, persistent=False)

    def hide(self, inputs: Sequence[int]) -> None:
        """Mask these inputs and set their weights to zero. Raises ValueError if one cannot be masked alone."""
        self.seen, weights = self._without(inputs)
        with torch.no_grad():
            for weight, seen in weights:
                weight *= seen

    @abstractmethod
    def _without(self, inputs: Sequence[int]) -> tuple[Tensor, list[tuple[Tensor, Tensor]]]:
        """Mask of the prepared inputs, and each weight of the first layer with the mask of its inputs."""

    def looked_at(self, prepared: Tensor) -> Tensor:
        """Prepared inputs with the mask applied."""
        return prepared if self.seen is None else prepared * self.seen


class DenseMlp(VectorPerceptron):
    """Perceptron without symmetry."""

    def __init__(self, inputs: int, hidden: Sequence[int], outputs: int, activation: str) -> None:
        super().__init__()
        self.activation = activation
        layers = nn.Sequential()
        for before, units in itertools.pairwise([inputs, *hidden]):
            layers.extend([nn.Linear(before, units), ACTIVATIONS[activation].module()])
        self.last = nn.Linear([inputs, *hidden][-1], outputs)
        self.layers = layers  # after `last`: checkpoints of the optimiser count parameters in this order

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
