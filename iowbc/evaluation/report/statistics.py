"""Intervals for what few trials can say."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import stats


def wilson_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Wilson's score interval of a success rate; sensible at 0 and at all of few trials. Raises ValueError."""
    if trials < 1 or not 0 <= successes <= trials:
        raise ValueError(f"successes {successes} of {trials} trials: need 0 <= successes <= trials and a trial")
    z = float(stats.norm.ppf(0.5 + confidence / 2))
    rate = successes / trials
    scale = 1 / (1 + z**2 / trials)
    centre = scale * (rate + z**2 / (2 * trials))
    half = scale * z * math.sqrt(rate * (1 - rate) / trials + z**2 / (4 * trials**2))
    low = 0.0 if successes == 0 else centre - half
    high = 1.0 if successes == trials else centre + half
    return low, high


def mean_half_width(values: NDArray[np.float64], confidence: float = 0.95) -> float | None:
    """Half the width of Student's interval of a mean; None for fewer than two values, which say nothing of spread."""
    if len(values) < 2:
        return None
    quantile = float(stats.t.ppf(0.5 + confidence / 2, len(values) - 1))
    return quantile * float(np.std(values, ddof=1)) / math.sqrt(len(values))
