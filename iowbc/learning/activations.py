"""Activation functions, also for pairs of mirrored units."""

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
    """Gradient at the input, from the gradient at the output and the output value."""


ACTIVATIONS = {
    "elu": Activation(nn.ELU, nn.functional.elu, lambda grad, y: aten.elu_backward(grad, 1, 1, 1, True, y)),
    "relu": Activation(nn.ReLU, torch.relu, lambda grad, y: aten.threshold_backward(grad, y, 0)),
    "tanh": Activation(nn.Tanh, torch.tanh, lambda grad, y: aten.tanh_backward(grad, y)),
}
"""Activations by their name in a recipe."""


class PairedActivation(nn.Module):
    """Activation of unit pairs (a, b). Inputs are (a + b) / 2 and (a - b) / 2, outputs a' + b' and a' - b'.

    Mirroring swaps a and b: the first output stays, the second changes sign, whatever the activation.
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
    """`PairedActivation` with a backward pass of half the steps and memory of torch's automatic one."""

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
