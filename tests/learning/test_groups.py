"""Advantages without what a group of environments has in common."""

import numpy as np
import pytest

from iowbc.learning.rollout import drawn_leaders, without_common_part

RANDOM = np.random.default_rng(0)


def of_groups(own: float, common: float, steps: int = 40, groups: int = 500, size: int = 4) -> np.ndarray:
    shared = common * RANDOM.normal(size=(steps, groups, 1))
    return (shared + own * RANDOM.normal(size=(steps, groups, size))).reshape(steps, -1).astype(np.float32)


def test_common_noise_is_removed_up_to_the_error_of_the_others_mean() -> None:
    advantage = of_groups(own=0.4, common=1.0)
    found = without_common_part(advantage, np.zeros(advantage.shape, np.bool_), 4)
    assert found.var() == pytest.approx(0.4**2 * 4 / 3, rel=0.1)
    assert found.mean() == pytest.approx(advantage.mean() * (1.0 - 1.0 / (1.0 + 0.16 / 3)), abs=0.02)


def test_independent_advantages_stay_as_they_are() -> None:
    advantage = of_groups(own=1.0, common=0.0)
    found = without_common_part(advantage, np.zeros(advantage.shape, np.bool_), 4)
    assert np.corrcoef(found.ravel(), advantage.ravel())[0, 1] > 0.999


def test_the_effect_of_an_action_stays() -> None:
    """The correlation with an own action, by which the policy learns, is that before."""
    action = RANDOM.normal(size=(40, 2000)).astype(np.float32)
    advantage = of_groups(own=0.2, common=1.0) + 0.3 * action
    found = without_common_part(advantage, np.zeros(advantage.shape, np.bool_), 4)
    assert (found * action).mean() == pytest.approx(0.3, abs=0.01)


def test_an_environment_is_on_its_own_after_the_end_of_its_episode() -> None:
    advantage, ended = of_groups(own=0.1, common=1.0), np.zeros((40, 2000), np.bool_)
    ended[9, 0] = True
    moved = advantage.copy()
    moved[10:, 0] += 100.0
    found, other = (without_common_part(values, ended, 4) for values in (advantage, moved))
    np.testing.assert_array_equal(found[:, 1:], other[:, 1:])
    np.testing.assert_array_equal(found[10:, 0], advantage[10:, 0])
    assert np.abs(found[:10, 0]).max() < 0.6


def test_leaders_are_of_their_own_group_and_each_is_drawn_as_often() -> None:
    drawn = np.stack([drawn_leaders(12, 4) for _ in range(400)])
    assert (drawn // 4 == np.arange(12) // 4).all()
    assert (drawn[:, ::4] == drawn[:, 3::4]).all()
    assert np.bincount(drawn[:, 0]) == pytest.approx(100, abs=40)
