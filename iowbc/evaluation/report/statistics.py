"""Intervals for what few trials can say."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats

CONFIDENCE = 0.95
"""Of every interval in tables and figures."""


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
