"""Intervals against worked examples."""

import numpy as np
import pytest

from iowbc.evaluation.report.statistics import mean_half_width, wilson_interval


def test_wilson_interval_of_four_in_five_is_the_textbook_one() -> None:
    low, high = wilson_interval(4, 5)
    assert (low, high) == pytest.approx((0.3755, 0.9638), abs=1e-4)


def test_wilson_interval_is_never_a_single_point_at_the_ends() -> None:
    assert wilson_interval(0, 5) == pytest.approx((0.0, 0.4345), abs=1e-4)
    assert wilson_interval(5, 5) == pytest.approx((0.5655, 1.0), abs=1e-4)


@pytest.mark.parametrize(("successes", "trials"), [(1, 0), (-1, 5), (6, 5)])
def test_impossible_counts_are_refused(successes: int, trials: int) -> None:
    with pytest.raises(ValueError, match=r"[nk]"):
        wilson_interval(successes, trials)


def test_mean_interval_of_five_values_uses_students_quantile() -> None:
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert mean_half_width(values) == pytest.approx(2.7764 * np.sqrt(2.5) / np.sqrt(5), abs=1e-4)


def test_one_value_has_no_interval() -> None:
    assert np.isnan(mean_half_width(np.array([1.0])))


def test_mean_interval_covers_the_truth_as_often_as_it_says() -> None:
    draws = np.random.default_rng(1).normal(size=(2000, 5))
    hits = [abs(row.mean()) <= mean_half_width(row) for row in draws]
    assert np.mean(hits) == pytest.approx(0.95, abs=0.015)
