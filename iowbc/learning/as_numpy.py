"""Conversion of trained networks to NumPy policies for rollouts; outputs agree up to rounding."""

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.arrays import Array
from iowbc.learning.networks import MirroredEncoder, Normalizer, StudentNetwork, TeacherNetwork
from iowbc.learning.perceptron import DenseMlp
from iowbc.learning.policy import ActorCritic, HistoryActor
from iowbc.learning.symmetric import SymmetricHead, SymmetricMlp
from iowbc.rollouts.policies import HistoryEncoder, HistoryPolicy, Layers, Linear, Normal, RowPolicy


def acting_policy(policy: ActorCritic) -> RowPolicy | HistoryPolicy:
    """NumPy policy of the mean action of PPO's policy."""
    normalizer, actor = policy.normalizer, policy.actor
    if isinstance(actor, HistoryActor):
        return student_policy(actor.network, _normal(normalizer, actor.network.observation))
    return RowPolicy(_normal(normalizer), _layers(actor))


def numpy_policy(network: TeacherNetwork | StudentNetwork) -> RowPolicy | HistoryPolicy:
    if isinstance(network, StudentNetwork):
        return student_policy(network)
    return RowPolicy(_normal(network.normalizer), _layers(network.body))


@torch.no_grad()
def _layers(network: nn.Module) -> Layers:
    """Layers of a perceptron. Those of a symmetric one act on units (a, b) instead of sums and differences.

    A symmetric layer computes E·(a + b) and O·(a - b). Its output units are the activations of their sum,
    (E + O)·a + (E - O)·b, and difference, (E - O)·a + (E + O)·b. The basis is folded into the first layer.
    """
    if isinstance(network, DenseMlp):
        layers = [layer for layer in (*network.layers, network.last) if isinstance(layer, nn.Linear)]
        first, *others = [_linear(layer) for layer in layers]
        if network.seen is not None:
            first = Linear(_array(network.seen)[:, None] * first.weight, first.bias)
        return Layers((first, *others), network.activation)
    assert isinstance(network, SymmetricMlp)
    basis = network.basis.matrix if network.seen is None else network.basis.matrix * network.seen
    even, odd = network.basis.split(basis)
    found = []
    for place, (keep, negate) in enumerate(zip(network.layers.even, network.layers.odd, strict=True)):
        assert isinstance(keep, nn.Linear)
        assert isinstance(negate, nn.Linear)
        if place:
            sums = torch.cat([keep.weight, keep.weight], dim=1).T
            differences = torch.cat([negate.weight, -negate.weight], dim=1).T
        else:
            sums, differences = even @ keep.weight.T, odd @ negate.weight.T
        weight = torch.cat([sums + differences, sums - differences], dim=1)
        found.append(Linear(_array(weight), _array(torch.cat([keep.bias, keep.bias]))))
    return Layers((*found, _head(network.last)), network.activation)


def _head(head: SymmetricHead) -> Linear:
    """Symmetric head as a linear layer on units (a, b) instead of sums and differences."""
    even, odd = head.basis.matrix[:, : head.basis.even].T, head.basis.matrix[:, head.basis.even :].T
    units = next(layer.weight.shape[1] for layer in (head.even, head.odd) if layer is not None)
    sums = differences = torch.zeros(units, len(head.basis.matrix))
    bias = torch.zeros(len(head.basis.matrix))
    if head.even is not None:
        sums, bias = head.even.weight.T @ even, head.even.bias @ even
    if head.odd is not None:
        differences = head.odd.weight.T @ odd
    return Linear(_array(torch.cat([sums + differences, sums - differences])), _array(bias))


@torch.no_grad()
def student_policy(network: StudentNetwork, normal: Normal | None = None) -> HistoryPolicy:
    """NumPy policy of a student; `normal`: the normalisation, by default the network's own."""
    own, mirror, estimate = network.encoder, None, None
    if isinstance(own, MirroredEncoder):
        mirror = own.permutation.numpy(), own.sign.numpy()
        own = own.encoder
    encoder = HistoryEncoder(_linear(own.frame[0]), _linear(own.whole[0]), own.activation, mirror)
    if network.estimate is not None:
        head = network.estimate.head
        estimate = _head(head) if isinstance(head, SymmetricHead) else _linear(head)
    return HistoryPolicy(normal or _normal(network.normalizer), encoder, estimate, _layers(network.body))


def _linear(layer: nn.Module) -> Linear:
    assert isinstance(layer, nn.Linear)
    return Linear(_array(layer.weight.T), _array(layer.bias))


def _normal(normalizer: Normalizer, size: int | None = None) -> Normal:
    """Input normalization; `size`: number of leading entries to keep."""
    return Normal(_array(normalizer.mean[:size]), _array(normalizer.std[:size]), normalizer.clip)


def _array(values: Tensor) -> Array:
    return np.array(values.detach().numpy(), order="C")
