"""Activations, and how a pair of mirrored units goes through one."""

from collections.abc import Callable
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.autograd import Function

aten = torch.ops.aten


class Activation(NamedTuple):
    """An activation whose derivative follows from its value."""

    module: type[nn.Module]
    function: Callable[[Tensor], Tensor]
    backward: Callable[[Tensor, Tensor], Tensor]
    """Gradient before the activation from that behind it and its value."""


ACTIVATIONS = {
    "elu": Activation(nn.ELU, nn.functional.elu, lambda grad, y: aten.elu_backward(grad, 1, 1, 1, True, y)),
    "relu": Activation(nn.ReLU, torch.relu, lambda grad, y: aten.threshold_backward(grad, y, 0)),
    "tanh": Activation(nn.Tanh, torch.tanh, lambda grad, y: aten.tanh_backward(grad, y)),
}
"""By their name in a recipe."""


class PairedActivation(nn.Module):
    """Activates units (a, b) that are given as halves of sum and difference; returns a' + b' and a' - b'.

    The mirror swaps a and b, so it keeps the first result and negates the second, whatever the activation.
    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self.activation = ACTIVATIONS[name]

    def forward(self, even: Tensor, odd: Tensor) -> tuple[Tensor, Tensor]:
        if even.requires_grad:
            sums, differences = _Paired.apply(even, odd, self.activation)  # type: ignore[no-untyped-call]
            return sums, differences
        one, other = self.activation.function(even + odd), self.activation.function(even - odd)
        return one + other, one - other


class _Paired(Function):
    """The same with a backward pass in half the steps and memory that torch would take on its own."""

    @staticmethod
    def forward(ctx: Any, even: Tensor, odd: Tensor, activation: Activation) -> tuple[Tensor, Tensor]:
        one, other = activation.function(even + odd), activation.function(even - odd)
        ctx.save_for_backward(one, other)
        ctx.activation = activation
        return one + other, one - other

    @staticmethod
    def backward(ctx: Any, sums: Tensor, differences: Tensor) -> tuple[Tensor, Tensor, None]:
        one, other = ctx.saved_tensors
        first = ctx.activation.backward(sums + differences, one)
        second = ctx.activation.backward(sums - differences, other)
        return first + second, first.sub_(second), None
