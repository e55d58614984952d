"""Counter-based random numbers."""

import numpy as np
import pytest

from iowbc import counter_random as random
from iowbc.recipe.simulation.randomization import Distribution


def keys(count: int, seed: int = 0) -> np.ndarray:
    return random.environment_key(seed, np.arange(count))


def test_numbers_depend_on_environment_not_on_its_neighbours():
    together = random.uniform(keys(10), "mass", 3)
    alone = random.uniform(random.environment_key(0, np.array([7])), "mass", 3)
    assert np.array_equal(together[7], alone[0])


def test_streams_seeds_and_episodes_give_different_numbers():
    base = random.uniform(keys(4), "mass", 2)
    assert not np.any(base == random.uniform(keys(4), "friction", 2))
    assert not np.any(base == random.uniform(keys(4, seed=1), "mass", 2))
    assert not np.any(base == random.uniform(random.absorb(keys(4), 1), "mass", 2))


def test_uniform_numbers_are_uniform_and_uncorrelated_between_environments():
    u = random.uniform(keys(20_000), "x", 4)
    assert np.all((u >= 0.0) & (u < 1.0))
    counts = np.histogram(u, bins=20, range=(0.0, 1.0))[0]
    expected = u.size / 20
    assert np.sum((counts - expected) ** 2 / expected) < 45.0  # chi-square, 19 degrees of freedom, p = 0.0007
    assert abs(np.corrcoef(u[:-1, 0], u[1:, 0])[0, 1]) < 0.02
    assert np.max(np.abs(np.corrcoef(u.T) - np.eye(4))) < 0.03


def test_sensor_noise_has_mean_zero_variance_one_and_is_new_each_step():
    steps = np.full(20_000, 5, np.uint64)
    x, later = random.noise(keys(20_000), steps, 6), random.noise(keys(20_000), steps + np.uint64(1), 6)
    assert abs(x.mean()) < 0.01
    assert x.std() == pytest.approx(1.0, abs=0.01)
    assert np.max(np.abs(np.corrcoef(x.T) - np.eye(6))) < 0.03
    assert abs(np.corrcoef(x.ravel(), later.ravel())[0, 1]) < 0.01


@pytest.mark.parametrize("shape", ["uniform", "log-uniform"])
def test_draws_stay_in_range_and_fill_it(shape):
    drawn = random.draw(keys(5000), "x", Distribution(low=0.5, high=2.0, nominal=1.0, shape=shape))
    assert drawn.min() >= 0.5
    assert drawn.max() <= 2.0
    assert np.ptp(drawn) > 1.3


def test_log_uniform_draws_have_as_many_below_as_above_the_geometric_mean():
    drawn = random.draw(keys(5000), "x", Distribution(low=0.01, high=1.0, nominal=0.1, shape="log-uniform"))
    assert np.mean(drawn < 0.1) == pytest.approx(0.5, abs=0.03)


def test_disabled_entries_and_undrawn_ones_are_nominal():
    off = Distribution(low=0.0, high=1.0, nominal=7.0, enabled=False)
    rare = Distribution(low=0.0, high=1.0, nominal=7.0, probability=0.25)
    assert np.all(random.draw(keys(100), "x", off) == 7.0)
    assert np.mean(random.draw(keys(5000), "x", rare) == 7.0) == pytest.approx(0.75, abs=0.03)


def test_a_range_that_descends_is_refused():
    with pytest.raises(ValueError, match=r"low \(2\.0\) is above high \(1\.0\)"):
        Distribution(low=2.0, high=1.0, nominal=1.0)
