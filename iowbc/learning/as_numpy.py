"""Trained networks as the policies in NumPy that rollouts are made with: the same function, to rounding."""

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.arrays import Array
from iowbc.learning.activations import ACTIVATIONS
from iowbc.learning.encoders import (
    KERNEL,
    STRIDE,
    ConvolutionalEncoder,
    MirroredEncoder,
    MlpEncoder,
    RecurrentEncoder,
)
from iowbc.learning.estimate import Estimate
from iowbc.learning.history_actor import HistoryActor
from iowbc.learning.networks import Normalizer, StudentNetwork, TeacherNetwork
from iowbc.learning.perceptron import DenseMlp
from iowbc.learning.policy import ActorCritic
from iowbc.learning.symmetric import SymmetricHead, SymmetricMlp
from iowbc.rollouts import encoders
from iowbc.rollouts.perceptron import Linear, Normal, Perceptron
from iowbc.rollouts.policies import HistoryPolicy, RowPolicy


def acting_policy(policy: ActorCritic) -> RowPolicy | HistoryPolicy:
    """The mean action of PPO's policy."""
    normalizer, actor = policy.normalizer, policy.actor
    if isinstance(actor, HistoryActor):
        return _history_policy(actor.network, _normal(normalizer, actor.observation))
    return RowPolicy(_normal(normalizer), perceptron(actor))


def teacher_policy(network: TeacherNetwork) -> RowPolicy:
    """A teacher's."""
    return RowPolicy(_normal(network.normalizer), perceptron(network.body))


def student_policy(network: StudentNetwork) -> HistoryPolicy:
    """A student's."""
    return _history_policy(network, _normal(network.normalizer))


@torch.no_grad()
def perceptron(network: nn.Module) -> Perceptron:
    """A perceptron; one that is symmetric by construction with its units (a, b) instead of sums and differences.

    Of the sums a layer makes E·(a + b), of the differences O·(a - b), and the units behind it are the activations of
    sum and difference of the two: (E + O)·a + (E - O)·b, and (E - O)·a + (E + O)·b. The first layer takes in the basis.
    """
    if isinstance(network, DenseMlp):
        layers = [layer for layer in (*network.layers, network.last) if isinstance(layer, nn.Linear)]
        first, *others = [_linear(layer) for layer in layers]
        if network.seen is not None:
            first = Linear(_array(network.seen)[:, None] * first.weight, first.bias)
        return Perceptron((first, *others), _activation(network.layers))
    assert isinstance(network, SymmetricMlp)
    basis = network.basis.matrix if network.seen is None else network.basis.matrix * network.seen
    even, odd = network.basis.split(basis)
    layers_of = list(zip(network.layers.even, network.layers.odd, strict=True))
    found = []
    for place, (keep, negate) in enumerate(layers_of):
        assert isinstance(keep, nn.Linear)
        assert isinstance(negate, nn.Linear)
        if place:
            sums = torch.cat([keep.weight, keep.weight], dim=1).T
            differences = torch.cat([negate.weight, -negate.weight], dim=1).T
        else:
            sums, differences = even @ keep.weight.T, odd @ negate.weight.T
        weight = torch.cat([sums + differences, sums - differences], dim=1)
        found.append(Linear(_array(weight), _array(torch.cat([keep.bias, keep.bias]))))
    return Perceptron((*found, _head(network.last)), _name(network.layers.activation.activation.module))


def _head(head: SymmetricHead) -> Linear:
    """A head on units (a, b) instead of sums and differences."""
    even, odd = head.basis.matrix[:, : head.basis.even].T, head.basis.matrix[:, head.basis.even :].T
    units = next(layer.weight.shape[1] for layer in (head.even, head.odd) if layer is not None)
    sums = differences = torch.zeros(units, len(head.basis.matrix))
    bias = torch.zeros(len(head.basis.matrix))
    if head.even is not None:
        sums, bias = head.even.weight.T @ even, head.even.bias @ even
    if head.odd is not None:
        differences = head.odd.weight.T @ odd
    return Linear(_array(torch.cat([sums + differences, sums - differences])), _array(bias))


def _history_policy(network: StudentNetwork, normal: Normal) -> HistoryPolicy:
    with torch.no_grad():
        estimate = None if network.estimate is None else _estimate(network.estimate)
        return HistoryPolicy(normal, encoder(network.encoder), estimate, perceptron(network.body))


def _estimate(estimate: Estimate) -> Linear:
    return _head(estimate.head) if isinstance(estimate.head, SymmetricHead) else _linear(estimate.head)


@torch.no_grad()
def encoder(module: nn.Module) -> encoders.Encoder:
    """An encoder of a history."""
    if isinstance(module, MirroredEncoder):
        return encoders.Mirrored(encoder(module.encoder), module.permutation.numpy(), module.sign.numpy())
    assert isinstance(module, MlpEncoder | ConvolutionalEncoder | RecurrentEncoder)
    frame, activation = _first(module.frame), _activation(module.frame)
    if isinstance(module, MlpEncoder):
        return encoders.Whole(frame, _first(module.whole), activation)
    if isinstance(module, RecurrentEncoder):
        unit = module.time.state_dict()
        given, kept = (Linear(_array(unit[f"weight_{of}_l0"].T), _array(unit[f"bias_{of}_l0"])) for of in ("ih", "hh"))
        return encoders.Recurrent(frame, given, kept, activation)
    convolutions = [layer for layer in module.time if isinstance(layer, nn.Conv1d)]
    time = [Linear(_array(layer.weight.permute(2, 1, 0).flatten(0, 1)), _array(layer.bias)) for layer in convolutions]
    whole, features = _first(module.whole), convolutions[-1].out_channels
    by_moment = whole.weight.reshape(features, -1, whole.weight.shape[1]).swapaxes(0, 1)
    whole = Linear(np.ascontiguousarray(by_moment.reshape(whole.weight.shape)), whole.bias)
    return encoders.Convolutional(frame, tuple(time), KERNEL, STRIDE, whole, activation)


def _first(layers: nn.Sequential) -> Linear:
    assert isinstance(layers[0], nn.Linear)
    return _linear(layers[0])


def _linear(layer: nn.Linear) -> Linear:
    return Linear(_array(layer.weight.T), _array(layer.bias))


def _normal(normalizer: Normalizer, size: int | None = None) -> Normal:
    """`size`: of the part of the statistics that is meant."""
    return Normal(_array(normalizer.mean[:size]), _array(normalizer.std[:size]), normalizer.clip)


def _activation(layers: nn.Sequential) -> str:
    return _name(type(layers[1])) if len(layers) > 1 else "elu"


def _name(module: type[nn.Module]) -> str:
    return next(name for name, activation in ACTIVATIONS.items() if activation.module is module)


def _array(values: Tensor | None) -> Array:
    assert values is not None
    return np.array(values.detach().numpy(), order="C")
