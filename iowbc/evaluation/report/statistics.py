"""Intervals for what few trials can say."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats

CONFIDENCE = 0.95
"""Of every interval in tables and figures."""
ENDS = ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)
"""Quantiles between which that part lies."""
RESAMPLES = 2000
"""Of a bootstrap."""


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Wilson's score interval of a success rate; sensible at 0 and at all of few trials. Raises ValueError."""
    interval = stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return float(interval.low), float(interval.high)


def mean_half_width(values: NDArray[np.float64]) -> float:
    """Half the width of Student's interval of a mean; NaN for fewer than two values, which say nothing of spread."""
    if len(values) < 2:
        return math.nan
    _, half = stats.t.interval(CONFIDENCE, len(values) - 1, scale=stats.sem(values))
    return float(half)


def determination(true: NDArray[np.float64], inferred: NDArray[np.float64]) -> float:
    """R²: the part of the variance that is inferred; 0 for who says the mean, NaN where nothing varies."""
    spread = np.sum(np.square(true - true.mean()))
    return float(1.0 - np.sum(np.square(true - inferred)) / spread) if spread > 0 else math.nan


def determination_interval(
    true: NDArray[np.float64], inferred: NDArray[np.float64], group: NDArray[np.int64]
) -> tuple[float, float]:
    """Bootstrap interval of R² where values of one group (n,) belong together: groups are drawn, not values."""
    terms = np.stack([np.ones_like(true), true, np.square(true), np.square(true - inferred)], axis=1)
    _, places = np.unique(group, return_inverse=True)
    sums = np.zeros((places.max() + 1, terms.shape[1]))
    np.add.at(sums, places, terms)
    drawn = np.random.default_rng(0).integers(len(sums), size=(RESAMPLES, len(sums)))
    count, total, square, error = sums[drawn].sum(axis=1).T
    spread = square - np.square(total) / count
    values = 1.0 - error[spread > 0] / spread[spread > 0]
    if not len(values):
        return math.nan, math.nan
    low, high = np.quantile(values, ENDS)
    return float(low), float(high)


def interquartile_mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean of the middle half of the last axis (..., n); of fewer than four values their mean."""
    return np.asarray(stats.trim_mean(values, 0.25, axis=-1), np.float64)


def percentile_interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Bootstrap interval from a statistic's values over resamples (n,), which may be infinite."""
    low, high = np.quantile(values, ENDS, method="nearest")
    return float(low), float(high)


def root_mean_square(true: NDArray[np.float64], inferred: NDArray[np.float64]) -> float:
    """Of the errors, in the unit of the values."""
    return float(np.sqrt(np.mean(np.square(true - inferred))))
