from typing import Any

import numpy as np
import torch
from point_masses import MIRRORS, PointMasses

from iowbc.learning import ppo
from iowbc.learning.teacher import TeacherTraining
from iowbc.recipe.teacher import Teacher

SETTINGS = Teacher(
    steps=16 * 8 * 6,
    environments=8,
    rollout=16,
    minibatches=2,
    hidden=(16,),
    learning_rate=1e-2,
)


def training(**changes: Any) -> TeacherTraining:
    return TeacherTraining(SETTINGS.model_copy(update=changes), PointMasses(), MIRRORS, seed=3)


def finish(some: TeacherTraining) -> TeacherTraining:
    while some.steps < some.planned:
        some.update()
    return some


def test_a_resumed_training_ends_bit_for_bit_where_an_unbroken_one_does() -> None:
    unbroken = finish(training())
    broken = training()
    for _ in range(3):
        broken.update()
    kept = {name: value.copy() for name, value in broken.arrays().items()}
    np.random.seed(99)  # noqa: NPY002 - SB3 draws from the global generator
    torch.manual_seed(99)
    resumed = training()
    resumed.restore(kept)
    assert resumed.steps == 3 * 16 * 8
    finish(resumed)
    expected, found = unbroken.arrays(), resumed.arrays()
    assert expected.keys() == found.keys()
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)


def test_the_network_that_is_kept_acts_as_the_trained_policy() -> None:
    some = finish(training())
    network, _ = some.network()
    raw = np.random.default_rng(0).normal(size=(9, 2)).astype(np.float32)
    normal = torch.from_numpy(some.normalized.normalize_obs(raw))
    expected = some.model.policy.get_distribution(normal).mode()
    torch.testing.assert_close(network(torch.from_numpy(raw)), expected, rtol=1e-5, atol=1e-6)


def test_the_step_size_follows_the_kl_divergence_within_its_bounds() -> None:
    some = training(learning_rate=1e-3, learning_rate_range=(5e-4, 1.1e-3))
    model, settings = some.model, some.settings
    assert ppo.adapt_learning_rate(model, settings, kl=0.04) == 1e-3
    assert ppo.adapt_learning_rate(model, settings, kl=0.01) == 1.1e-3
    for _ in range(9):
        rate = ppo.adapt_learning_rate(model, settings, kl=0.2)
    assert rate == 5e-4
    assert model.lr_schedule(0.5) == 5e-4
