"""Rollouts act as the networks that learn do, and the same for whoever computes them."""

from typing import Any

import numpy as np
import pytest
import torch
from gymnasium import spaces

from iowbc.learning.as_numpy import acting_policy, numpy_policy, student_policy
from iowbc.learning.networks import StudentNetwork, TeacherNetwork, mirror_as_json
from iowbc.learning.policy import ActorCritic
from iowbc.robot.mirror import MirrorMap
from iowbc.rollouts.blocks import block_size, in_blocks, shares_in_blocks

OBSERVATION = MirrorMap(np.array([1, 0, 2, 3]), np.array([1, 1, -1, 1], np.float32))
ACTION = MirrorMap(np.array([1, 0, 2]), np.array([-1, -1, 1], np.float32))
TOLD = MirrorMap(np.array([0, 1]), np.array([1, -1], np.float32))


def mirrors(symmetric: bool) -> Any:
    return [mirror_as_json(OBSERVATION), mirror_as_json(ACTION)] if symmetric else None


def shaken(network: torch.nn.Module) -> Any:
    """With biases that are not zero, and statistics."""
    torch.manual_seed(0)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.1 * torch.randn_like(parameter)
        for name, values in network.named_buffers():
            if name.endswith("normalizer.mean"):
                values.normal_()
            elif name.endswith("normalizer.std"):
                values.uniform_(0.5, 2.0)
    return network


@pytest.mark.parametrize("activation", ["elu", "relu", "tanh"])
@pytest.mark.parametrize("symmetric", [False, True])
def test_a_teacher_in_numpy_acts_as_its_network(symmetric: bool, activation: str) -> None:
    network = shaken(TeacherNetwork(4, 3, (32, 16, 8), activation, 2.0, mirrors(symmetric)))
    rows = 3.0 * torch.randn(20, 4)
    with torch.no_grad():
        np.testing.assert_allclose(numpy_policy(network)(rows.numpy()), network(rows).numpy(), rtol=1e-6, atol=4e-6)


@pytest.mark.parametrize("told", [None, TOLD])
@pytest.mark.parametrize("symmetric", [False, True])
def test_a_student_in_numpy_acts_as_its_network(symmetric: bool, told: MirrorMap | None) -> None:
    sizes = {"observation": 4, "actions": 3, "frame_features": 8, "latent": 12, "hidden": [16], "clip": 2.0}
    privileged = None if told is None else mirror_as_json(told)
    for length in (1, 6, 25):
        network = StudentNetwork(
            **sizes,
            history=length,
            activation="elu",
            mirrors=mirrors(symmetric),
            privileged=privileged,
        )
        histories = 3.0 * torch.randn(10, length, 4)
        with torch.no_grad():
            expected = shaken(network)(histories).numpy()
        np.testing.assert_allclose(student_policy(network)(histories.numpy()), expected, rtol=1e-6, atol=4e-6)


@pytest.mark.parametrize("symmetric", [False, True])
def test_what_is_hidden_from_a_policy_moves_none_of_its_actions_in_numpy(symmetric: bool) -> None:
    box = spaces.Box(-np.inf, np.inf, (4,)), spaces.Box(-1, 1, (3,))
    settings = {"hidden": [16], "activation": "elu", "clip": 10.0, "initial_std": 0.5, "std_learning_rate": 1e-3}
    policy = shaken(ActorCritic(*box, lambda _: 1e-3, **settings, mirrors=mirrors(symmetric), value_only=[3]))
    rows = torch.randn(8, 4)
    told = rows + torch.tensor([0.0, 0.0, 0.0, 5.0])
    with torch.no_grad():
        expected = policy.get_distribution(rows).mode().numpy()
    own = acting_policy(policy)
    np.testing.assert_allclose(own(rows.numpy()), expected, rtol=1e-6, atol=4e-6)
    np.testing.assert_array_equal(own(rows.numpy()), own(told.numpy()))


@pytest.mark.parametrize("environments", [1, 3, 8, 20, 33, 96])
def test_a_row_gets_the_same_bits_whichever_blocks_are_computed_with_it(environments: int) -> None:
    network = shaken(TeacherNetwork(4, 3, (64, 32), "elu", 10.0, mirrors(True)))
    policy, rows = numpy_policy(network), np.random.default_rng(0).normal(size=(environments, 4)).astype(np.float32)
    size = block_size(environments)
    together = in_blocks(policy, size, rows)
    for parts in (1, 2, 3, 7, 200):
        groups = shares_in_blocks(environments, parts)
        found = np.concatenate([in_blocks(policy, size, rows[first:last]) for first, last in groups])
        np.testing.assert_array_equal(found, together)


@pytest.mark.parametrize("environments", [1, 2, 7, 8, 31, 96, 2048])
@pytest.mark.parametrize("parts", [1, 2, 5, 8, 64])
def test_shares_are_whole_blocks_that_cover_everything_once_and_nearly_evenly(environments: int, parts: int) -> None:
    groups, size = shares_in_blocks(environments, parts), block_size(environments)
    assert [first for first, _ in groups] == [0, *(last for _, last in groups[:-1])]
    assert groups[-1][1] == environments
    assert all(first % size == 0 for first, _ in groups)
    counts = [last - first for first, last in groups]
    assert min(counts) >= 1
    assert max(counts) - min(counts) < 2 * size
    assert len(groups) == min(parts, -(-environments // size))
