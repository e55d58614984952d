import math

import numpy as np
import torch

from iowbc.learning.gaussian import divergence, entropy, exploration, log_density
from iowbc.learning.rollout import advantages


def column(*values: float) -> np.ndarray:
    return np.array(values, np.float32)[:, None]


def test_advantages_agree_with_a_worked_example() -> None:
    found = advantages(
        rewards=column(1.0, 0.0, 2.0),
        ended=np.zeros((3, 1), np.bool_),
        values=column(0.5, 1.0, 0.0),
        last_value=np.array([4.0], np.float32),
        discount=0.5,
        decay=0.5,
    )
    # surprises: 1 + .5·1 - .5 = 1;  0 + .5·0 - 1 = -1;  2 + .5·4 - 0 = 4;  each passes a quarter to the one before
    np.testing.assert_allclose(found[:, 0], [1 + 0.25 * 0.0, -1 + 0.25 * 4, 4.0])


def test_nothing_passes_from_an_episode_to_the_one_before() -> None:
    ended = np.array([[False], [True], [False]])
    rewards, values = column(1.0, 2.0, 7.0), column(0.0, 3.0, 100.0)
    found = advantages(rewards, ended, values, np.array([50.0], np.float32), 0.9, 0.8)
    np.testing.assert_allclose(found[1, 0], 2.0 - 3.0)
    np.testing.assert_allclose(found[0, 0], 1.0 + 0.9 * 3.0 + 0.9 * 0.8 * (2.0 - 3.0), rtol=1e-6)


def test_an_episode_cut_off_where_all_is_worth_the_same_has_no_advantage() -> None:
    discount, value = 0.9, 10.0
    rewards = np.full((4, 1), 1.0, np.float32)
    rewards[1] += discount * value  # the value of what the time limit cut off
    ended = np.array([[False], [True], [False], [False]])
    found = advantages(
        rewards, ended, np.full((4, 1), value, np.float32), np.full(1, value, np.float32), discount, 0.95
    )
    np.testing.assert_allclose(found, 0.0, atol=1e-5)


def test_density_entropy_and_divergence_are_those_of_torch() -> None:
    torch.manual_seed(0)
    mean, other, actions = torch.randn(3, 5, 4)
    log_std, other_log_std = torch.randn(2, 4)
    ours = torch.distributions.Normal(mean, log_std.exp())
    theirs = torch.distributions.Normal(other, other_log_std.exp())
    torch.testing.assert_close(log_density(actions, mean, log_std), ours.log_prob(actions).sum(-1))
    torch.testing.assert_close(entropy(log_std), ours.entropy().sum(-1)[0])
    expected = torch.distributions.kl_divergence(ours, theirs).sum(-1)
    torch.testing.assert_close(divergence(mean, log_std, other, other_log_std), expected)


def test_the_closed_form_does_not_depend_on_which_actions_were_drawn() -> None:
    mean, other, log_std = torch.zeros(1, 2), torch.tensor([[0.1, 0.0]]), torch.full((2,), math.log(0.5))
    assert math.isclose(float(divergence(mean, log_std, other, log_std)), 0.01 / (2 * 0.25), rel_tol=1e-5)


def test_correlated_noise_is_standard_normal_at_every_step_and_forgets_geometrically() -> None:
    torch.manual_seed(0)
    noise = exploration((30, 4000), torch.zeros(3), 0.8)
    torch.testing.assert_close(noise.square().mean((1, 2)), torch.ones(30), rtol=0, atol=0.05)
    for lag in (1, 3):
        found = (noise[lag:] * noise[:-lag]).mean((1, 2))
        torch.testing.assert_close(found, torch.full_like(found, 0.8**lag), rtol=0, atol=0.05)


def test_noise_without_correlation_is_independent() -> None:
    torch.manual_seed(0)
    noise = exploration((30, 40), torch.zeros(3), 0.0)
    torch.manual_seed(0)
    torch.testing.assert_close(noise, torch.randn(30, 40, 3), rtol=0, atol=0)
