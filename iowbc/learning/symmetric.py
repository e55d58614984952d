"""Networks that commute with the left-right mirror by construction.

Hidden units come in pairs (a, b) that the mirror swaps. In the basis of sums a + b, which the mirror keeps, and
differences a - b, which it negates, an equivariant linear layer is two products of half the size; only the sums have a
bias. Activations act on a and b themselves: applied to a difference, they would not be odd. The symmetry is exact up to
rounding and holds for all inputs, not only for those seen in training.
"""

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.autograd import Function

from iowbc.learning.perceptron import ACTIVATIONS, Activation, Hidden, VectorPerceptron
from iowbc.robot.mirror import MirrorMap

Parts = tuple[Tensor, Tensor]
"""Even part, which the mirror keeps, and odd part, which it negates."""


class MirrorBasis(nn.Module):
    """Orthonormal basis of the even and the odd part of a vector under its mirror."""

    matrix: Tensor

    def __init__(self, mirror: MirrorMap) -> None:
        """Raises ValueError where the map is not its own inverse."""
        super().__init__()
        even, odd = _eigenvectors(mirror)
        self.even, self.odd = len(even), len(odd)
        matrix = torch.from_numpy(np.stack([*even, *odd], axis=1).astype(np.float32))
        self.register_buffer("matrix", matrix, persistent=False)

    def forward(self, x: Tensor) -> Tensor:
        """(..., n) to its even part, then its odd part, (..., n)."""
        return x @ self.matrix

    def split(self, x: Tensor) -> Parts:
        """The parts of what `forward` returned."""
        return x[..., : self.even], x[..., self.even :]

    def inverse(self, even: Tensor, odd: Tensor) -> Tensor:
        """From even and odd part back to (..., n)."""
        return torch.cat([even, odd], dim=-1) @ self.matrix.T


def _eigenvectors(mirror: MirrorMap) -> tuple[list[Any], list[Any]]:
    """Orthonormal eigenvectors of the mirror with eigenvalue +1, and those with -1."""
    permutation, sign = mirror.permutation, np.asarray(mirror.sign, np.float64)
    if np.any(permutation[permutation] != np.arange(len(sign))) or np.any(sign != sign[permutation]):
        raise ValueError(f"a mirror is its own inverse; this map is not: {permutation.tolist()}, {sign.tolist()}")
    unit = np.eye(len(sign))
    even: list[Any] = []
    odd: list[Any] = []
    for place, other in enumerate(permutation.tolist()):
        if other == place:
            (even if sign[place] > 0 else odd).append(unit[place])
        elif other > place:
            even.append((unit[place] + sign[place] * unit[other]) / np.sqrt(2.0))
            odd.append((unit[place] - sign[place] * unit[other]) / np.sqrt(2.0))
    return even, odd


def activated_pairs(activation: Activation, even: Tensor, odd: Tensor) -> Parts:
    """Activation of unit pairs (a, b). Inputs are (a + b) / 2 and (a - b) / 2, outputs a' + b' and a' - b'. Mirroring
    swaps a and b: the first output stays, the second changes sign, whatever the activation."""
    if even.requires_grad:
        sums, differences = _Paired.apply(even, odd, activation)  # type: ignore[no-untyped-call]
        return sums, differences
    one, other = activation.function(even + odd), activation.function(even - odd)
    return one + other, one - other


class _Paired(Function):
    """`activated_pairs` with a backward pass of half the steps and memory of torch's automatic one."""

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


class SymmetricLayers(nn.Module):
    """Hidden layers: even and odd part of an input to sums and differences of the last layer's pairs."""

    def __init__(self, even: int, odd: int, hidden: Sequence[int], activation: str) -> None:
        """`even`, `odd`: sizes of the two parts; `hidden`: units of the layers. Raises ValueError for an odd number."""
        super().__init__()
        halves = [paired(size) for size in hidden]
        self.even = nn.ModuleList(itertools.starmap(nn.Linear, itertools.pairwise([even, *halves])))
        self.odd = nn.ModuleList(nn.Linear(*sizes, bias=False) for sizes in itertools.pairwise([odd, *halves]))
        self.activation = ACTIVATIONS[activation]

    def forward(self, even: Tensor, odd: Tensor) -> Parts:
        for keep, negate in zip(self.even, self.odd, strict=True):
            even, odd = activated_pairs(self.activation, keep(even), negate(odd))
        return even, odd

    def initialize(self, gain: float) -> None:
        """Orthogonal weights in the orthonormal basis of the pairs, as a dense layer would have; no bias."""
        for layers in (self.even, self.odd):
            for place, layer in enumerate(layers):
                assert isinstance(layer, nn.Linear)
                nn.init.orthogonal_(layer.weight, gain / (2.0 if place else np.sqrt(2.0)))
                if layer.bias is not None:
                    nn.init.zeros_(layer.bias)


class SymmetricHead(nn.Module):
    """Linear layer from sums and differences to an output with its own mirror."""

    def __init__(self, units: int, mirror: MirrorMap) -> None:
        """`units`: of the previous layer, an even number."""
        super().__init__()
        self.basis = MirrorBasis(mirror)
        self.even = nn.Linear(paired(units), self.basis.even) if self.basis.even else None
        self.odd = nn.Linear(paired(units), self.basis.odd, bias=False) if self.basis.odd else None

    def forward(self, sums: Tensor, differences: Tensor) -> Tensor:
        even = sums[..., :0] if self.even is None else self.even(sums)
        odd = differences[..., :0] if self.odd is None else self.odd(differences)
        return self.basis.inverse(even, odd)

    def initialize(self, gain: float) -> None:
        """See `SymmetricLayers.initialize`."""
        if self.even is not None:
            nn.init.orthogonal_(self.even.weight, gain / np.sqrt(2.0))
            nn.init.zeros_(self.even.bias)
        if self.odd is not None:
            nn.init.orthogonal_(self.odd.weight, gain / np.sqrt(2.0))


class SymmetricMlp(VectorPerceptron):
    """Multilayer perceptron whose output is mirrored when its input is. `prepare` transforms to the mirror basis."""

    def __init__(self, inputs: MirrorMap, hidden: Sequence[int], outputs: MirrorMap, activation: str) -> None:
        super().__init__()
        self.activation, self.basis = activation, MirrorBasis(inputs)
        self.layers = SymmetricLayers(self.basis.even, self.basis.odd, hidden, activation)
        self.last = SymmetricHead(hidden[-1], outputs)

    def prepare(self, x: Tensor) -> Tensor:
        return self.basis(x)

    def hidden(self, prepared: Tensor) -> Hidden:
        return self.layers(*self.basis.split(self.looked_at(prepared)))

    def _without(self, inputs: Sequence[int]) -> tuple[Tensor, list[tuple[Tensor, Tensor]]]:
        hidden = self.basis.matrix.new_zeros(len(self.basis.matrix))
        hidden[list(inputs)] = 1.0
        share = hidden @ self.basis.matrix.square()
        if bool(((share > 0.01) & (share < 0.99)).any()):
            raise ValueError("an input and its mirror image are hidden together")
        seen = (share < 0.5).float()
        weights = []
        for layers, part in zip((self.layers.even, self.layers.odd), self.basis.split(seen), strict=True):
            assert isinstance(layers[0], nn.Linear)
            weights.append((layers[0].weight, part))
        return seen, weights

    def head(self, hidden: Hidden) -> Tensor:
        sums, differences = hidden
        return self.last(sums.float(), differences.float())

    def initialize(self, gain: float, last: float) -> None:
        self.layers.initialize(gain)
        self.last.initialize(last)


def paired(units: int) -> int:
    """Number of pairs in a layer. Raises ValueError for an odd number of units."""
    if units % 2:
        raise ValueError(f"the mirror swaps hidden units in pairs, so that a layer has an even number, not {units}")
    return units // 2
