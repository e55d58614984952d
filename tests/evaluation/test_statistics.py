"""Intervals against worked examples."""

import numpy as np
import pytest
from scipy import stats

from iowbc.evaluation.report.statistics import (
    design_effect,
    mean_half_width,
    mean_p,
    sign_flip_p,
    standard_error,
    wilson_interval,
)


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


def test_repeating_a_world_says_nothing_new() -> None:
    values, worlds = np.array([1.0, 2.0, 4.0]), np.arange(3)
    often = np.tile(values, 7), np.tile(worlds, 7)
    assert mean_half_width(*often) == pytest.approx(mean_half_width(values))
    assert mean_p(*often) == pytest.approx(mean_p(values))
    assert mean_half_width(often[0]) < 0.3 * mean_half_width(values), "as rows they would seem to"


def test_without_shared_worlds_error_and_p_are_the_textbooks() -> None:
    values = np.random.default_rng(0).normal(0.3, 1.0, 12)
    assert standard_error(values) == (pytest.approx(stats.sem(values)), 12)
    assert mean_p(values) == pytest.approx(stats.ttest_1samp(values, 0.0).pvalue)


def test_intervals_over_worlds_cover_the_truth_where_those_over_rows_do_not() -> None:
    random = np.random.default_rng(2)
    worlds = np.repeat(np.arange(20), 10)
    covered = {"worlds": 0, "rows": 0}
    for _ in range(500):
        values = random.normal(size=20)[worlds] + 0.3 * random.normal(size=200)
        covered["worlds"] += abs(values.mean()) <= mean_half_width(values, worlds)
        covered["rows"] += abs(values.mean()) <= mean_half_width(values)
    assert covered["worlds"] / 500 == pytest.approx(0.95, abs=0.03)
    assert covered["rows"] / 500 < 0.6


def test_worlds_that_go_alike_count_once_in_a_rate() -> None:
    once = np.array([True, True, True, False])
    often, worlds = np.tile(once, 5), np.tile(np.arange(4), 5)
    assert design_effect(often, worlds) == pytest.approx(5.0)
    assert design_effect(once, np.arange(4)) == 1.0
    assert design_effect(np.ones(20, bool), worlds) == 5.0, "all alike: nothing tells worlds and trials apart"
    assert wilson_interval(15, 20, 5.0) == pytest.approx(wilson_interval(3, 4))


def test_flipping_signs_is_mcnemars_test_of_single_trials_and_cautious_with_shared_worlds() -> None:
    assert sign_flip_p(np.array([1] * 9 + [-1])) == pytest.approx(stats.binomtest(9, 10).pvalue)
    assert sign_flip_p(np.zeros(4, np.int64)) == 1.0
    assert sign_flip_p(np.array([10, 10, 10])) == pytest.approx(0.25), "three worlds, whatever number of masses"
