"""The mirror law: what the networks make of a mirror image is the mirror image of what they make."""

from typing import Any

import numpy as np
import pytest
import torch
from gymnasium import spaces
from mirrored import mirror_tensor

from iowbc.learning.networks import SymmetricMlp, TeacherNetwork, mirror_as_json
from iowbc.learning.normalization import SymmetricMeanStd
from iowbc.learning.perceptron import ACTIVATIONS
from iowbc.learning.policy import ActorCritic
from iowbc.learning.symmetric import MirrorBasis, SymmetricLayers, activated_pairs
from iowbc.robot.mirror import MirrorMap

OBSERVATION = MirrorMap(np.array([1, 0, 2, 3, 5, 4]), np.array([1, 1, -1, 1, -1, -1], np.float32))
ACTION = MirrorMap(np.array([2, 1, 0]), np.array([-1, -1, -1], np.float32))


def randomized(network: Any) -> Any:
    """The network with weights and biases that no initialisation would give."""
    torch.manual_seed(1)
    for parameter in network.parameters():
        parameter.data.normal_(0.0, 0.5)
    return network


@pytest.mark.parametrize("activation", ["elu", "relu", "tanh"])
def test_a_symmetric_network_commutes_with_the_mirror_whatever_its_weights(activation: str) -> None:
    network = randomized(SymmetricMlp(OBSERVATION, (8, 6), ACTION, activation))
    x = torch.randn(50, 6)
    mirrored = network(mirror_tensor(OBSERVATION, x))
    torch.testing.assert_close(mirrored, mirror_tensor(ACTION, network(x)), rtol=0, atol=1e-5)
    assert float((mirrored - network(x)).abs().max().detach()) > 0.1, "the mirror does something"


def test_hidden_inputs_decide_nothing_and_hide_with_their_mirror_images() -> None:
    network = randomized(SymmetricMlp(OBSERVATION, (8, 6), ACTION, "elu"))
    with pytest.raises(ValueError, match="hidden together"):
        network.hide([4])
    network.hide([3, 4, 5])
    again = SymmetricMlp(OBSERVATION, (8, 6), ACTION, "elu")
    again.load_state_dict(network.state_dict())
    x, y = torch.randn(2, 20, 6)
    y[:, :3] = x[:, :3]
    for each in (network, again):
        torch.testing.assert_close(each(y), network(x), rtol=0, atol=1e-6)
    y[:, 0] += 1.0
    assert float((network(y) - network(x)).abs().max().detach()) > 0.1


def test_odd_and_even_parts_make_the_vector_again() -> None:
    basis = MirrorBasis(OBSERVATION)
    assert (basis.even, basis.odd) == (3, 3)
    x = torch.randn(7, 6)
    parts = basis.split(basis(x))
    torch.testing.assert_close(basis.inverse(*parts), x)
    even, odd = basis.split(basis(mirror_tensor(OBSERVATION, x)))
    torch.testing.assert_close(even, parts[0], rtol=0, atol=1e-6)
    torch.testing.assert_close(odd, -parts[1], rtol=0, atol=1e-6)


def test_a_map_that_is_not_its_own_inverse_is_no_mirror() -> None:
    with pytest.raises(ValueError, match="its own inverse"):
        MirrorBasis(MirrorMap(np.array([1, 2, 0]), np.ones(3)))
    with pytest.raises(ValueError, match="its own inverse"):
        MirrorBasis(MirrorMap(np.array([1, 0]), np.array([1.0, -1.0])))


def test_a_layer_of_pairs_is_the_dense_layer_with_swapped_weights() -> None:
    layers = randomized(SymmetricLayers(2, 2, (6, 4), "tanh"))
    keep, keep2 = layers.even
    negate, negate2 = layers.odd
    sums, differences = torch.randn(9, 2), torch.randn(9, 2)
    first = torch.tanh(keep(sums) + negate(differences)), torch.tanh(keep(sums) - negate(differences))
    straight, crossed = keep2.weight + negate2.weight, keep2.weight - negate2.weight
    dense = torch.cat([torch.cat([straight, crossed], 1), torch.cat([crossed, straight], 1)])
    second = torch.tanh(torch.cat(first, 1) @ dense.T + torch.cat([keep2.bias, keep2.bias]))
    one, other = second.split(2, dim=1)
    found = layers(sums, differences)
    torch.testing.assert_close(found[0], one + other)
    torch.testing.assert_close(found[1], one - other)


@pytest.mark.parametrize("activation", ["elu", "relu", "tanh"])
def test_the_gradient_of_paired_units_is_that_of_their_formula(activation: str) -> None:
    even, odd = (torch.randn(5, 4, requires_grad=True) for _ in range(2))
    function = ACTIVATIONS[activation].function
    one, other = function(even + odd), function(even - odd)
    weights = torch.randn(2, 5, 4)
    expected = torch.autograd.grad((weights[0] * (one + other) + weights[1] * (one - other)).sum(), (even, odd))
    sums, differences = activated_pairs(ACTIVATIONS[activation], even, odd)
    found = torch.autograd.grad((weights[0] * sums + weights[1] * differences).sum(), (even, odd))
    for a, b in zip(found, expected, strict=True):
        torch.testing.assert_close(a, b)


def test_layers_begin_with_the_variance_of_dense_orthogonal_ones() -> None:
    torch.manual_seed(0)
    network = SymmetricMlp(OBSERVATION, (64, 32), ACTION, "relu")
    network.initialize(1.0, 1.0)
    even, odd = network.layers.even[1], network.layers.odd[1]
    straight, crossed = even.weight + odd.weight, even.weight - odd.weight
    dense = torch.cat([torch.cat([straight, crossed], 1), torch.cat([crossed, straight], 1)])
    torch.testing.assert_close(dense @ dense.T, torch.eye(32), atol=1e-5, rtol=0)


def test_an_odd_number_of_units_cannot_be_paired() -> None:
    with pytest.raises(ValueError, match=r"pairs.*not 7"):
        SymmetricMlp(OBSERVATION, (7,), ACTION, "elu")


def test_policy_is_mirrored_its_deviation_tied_and_the_value_invariant() -> None:
    policy = randomized(
        ActorCritic(
            spaces.Box(-9, 9, (6,)),
            spaces.Box(-9, 9, (3,)),
            lambda _: 1e-3,
            hidden=[8, 6],
            activation="elu",
            clip=10.0,
            initial_std=0.5,
            std_learning_rate=1e-3,
            mirrors=[mirror_as_json(OBSERVATION), mirror_as_json(ACTION)],
        )
    )
    x = torch.randn(50, 6)
    image = mirror_tensor(OBSERVATION, x)
    mean, mirrored = policy.get_distribution(x).mode(), policy.get_distribution(image).mode()
    torch.testing.assert_close(mirrored, mirror_tensor(ACTION, mean), rtol=0, atol=1e-5)
    torch.testing.assert_close(policy.predict_values(image), policy.predict_values(x), rtol=0, atol=1e-5)
    assert policy.log_stds.shape == (2,)
    assert policy.log_std[0] == policy.log_std[2] != policy.log_std[1]


def test_a_teacher_with_symmetric_statistics_obeys_the_law_from_raw_observations() -> None:
    statistics = SymmetricMeanStd(OBSERVATION)
    random = np.random.default_rng(0)
    for _ in range(20):
        statistics.update(random.normal([1, 3, 5, 0, 1, 2], [1, 2, 3, 1, 2, 1], (64, 6)).astype(np.float32))
    mirrors = [mirror_as_json(OBSERVATION), mirror_as_json(ACTION)]
    network = randomized(TeacherNetwork(6, 3, [8], "elu", 10.0, mirrors))
    network.normalizer.mean.copy_(torch.from_numpy(statistics.mean))
    network.normalizer.std.copy_(torch.from_numpy(np.sqrt(statistics.var)))
    x = 3.0 * torch.randn(50, 6)
    torch.testing.assert_close(
        network(mirror_tensor(OBSERVATION, x)), mirror_tensor(ACTION, network(x)), rtol=0, atol=1e-5
    )


def test_symmetric_statistics_are_those_of_the_samples_and_their_images() -> None:
    samples = np.random.default_rng(0).normal([1, 3, 5, 0, 1, 2], 2.0, (640, 6)).astype(np.float32)
    statistics = SymmetricMeanStd(OBSERVATION)
    for part in np.split(samples, 10):
        statistics.update(part)
    both = np.concatenate([samples, OBSERVATION(samples)])
    np.testing.assert_allclose(statistics.mean, both.mean(0), atol=1e-5)
    np.testing.assert_allclose(statistics.var, both.var(0), rtol=1e-4)
