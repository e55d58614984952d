"""Confidence intervals and tests for few trials.

Trials of one number share the same world (random draws and commands) at every mass, in every suite and with every
training. They form a cluster, and the number of worlds determines the precision.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

CONFIDENCE = 0.95
"""Confidence level of every interval in tables and figures."""
ENDS = ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)
"""Quantiles of the ends of such an interval."""
RESAMPLES = 2000


def wilson_interval(successes: int, trials: int, design: float = 1.0) -> tuple[float, float]:
    """Wilson's score interval of a success rate, valid also for 0 or all of few trials. Raises ValueError.

    design: design effect, by which the number of trials is divided (`design_effect`).
    """
    if not 0 <= successes <= trials or trials == 0:
        raise ValueError(f"{successes} of {trials} is no rate: n trials have 0 to n successes, and n is at least 1")
    rate, count, z = successes / trials, trials / design, float(stats.norm.ppf(ENDS[1]))
    middle = (rate + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * math.sqrt(rate * (1 - rate) / count + z**2 / (4 * count**2))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def standard_error(values: NDArray[np.float64], worlds: NDArray[np.int64] | None = None) -> tuple[float, int]:
    """Standard error of a mean, and number of clusters G; NaN for fewer than two.

    s² = G / (G - 1) · Σ_g (Σ_i (x_gi - x̄))² / n², the cluster-robust variance: values (n,) of one world may be
    correlated in any way. Without `worlds`, (n,), values are independent and s is the usual standard error.
    """
    _, places = np.unique(np.arange(len(values)) if worlds is None else worlds, return_inverse=True)
    clusters = int(places.max(initial=-1)) + 1
    if clusters < 2:
        return math.nan, clusters
    sums = np.bincount(places, values - values.mean())
    return float(np.sqrt(clusters / (clusters - 1) * np.sum(np.square(sums)))) / len(values), clusters


def mean_half_width(values: NDArray[np.float64], worlds: NDArray[np.int64] | None = None) -> float:
    """Half the width of Student's interval of a mean; NaN for fewer than two worlds."""
    error, clusters = standard_error(values, worlds)
    return math.nan if clusters < 2 else error * float(stats.t.ppf(ENDS[1], clusters - 1))


def mean_p(values: NDArray[np.float64], worlds: NDArray[np.int64] | None = None) -> float:
    """P-value of Student's t-test for a mean of zero, with worlds as clusters; NaN for fewer than two."""
    error, clusters = standard_error(values, worlds)
    return math.nan if clusters < 2 else float(2.0 * stats.t.sf(abs(values.mean()) / error, clusters - 1))


def sign_flip_p(differences: NDArray[np.int64]) -> float:
    """Exact p-value of a sign-flip permutation test of integer differences (worlds,), P(|Σ ±d| >= |Σ d|) over all
    signs, from the distribution of the sum; McNemar's test if all are ±1."""
    sizes = np.abs(differences[differences != 0])
    total, observed = int(sizes.sum()), abs(int(differences.sum()))
    sums, chances = np.arange(-total, total + 1), np.ones(1)
    for size in sizes.tolist():
        chances = 0.5 * (np.pad(chances, (0, 2 * size)) + np.pad(chances, (2 * size, 0)))
    return min(1.0, float(chances[np.abs(sums) >= observed].sum()))


def design_effect(successes: NDArray[np.bool_], worlds: NDArray[np.int64]) -> float:
    """Design effect: number of trials (n,) divided by the number of independent trials of equal precision; between 1
    and the trials per world. The latter if all outcomes are equal, since trials of one world may always agree."""
    clusters = len(np.unique(worlds))
    most, values = len(successes) / clusters, successes.astype(np.float64)
    if clusters < 2 or not np.ptp(values):
        return most
    ratio = standard_error(values, worlds)[0] / standard_error(values)[0]
    return float(np.clip(ratio**2, 1.0, most))


def r_squared(true: NDArray[np.float64], inferred: NDArray[np.float64]) -> float:
    """R², the fraction of variance explained; 0 for a prediction of the mean, NaN if the true values do not vary."""
    spread = np.sum(np.square(true - true.mean()))
    return float(1.0 - np.sum(np.square(true - inferred)) / spread) if spread > 0 else math.nan


def determination_interval(
    true: NDArray[np.float64], inferred: NDArray[np.float64], group: NDArray[np.int64]
) -> tuple[float, float]:
    """Bootstrap interval of R², with resampling of groups (n,) rather than values."""
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
    """Mean of the middle half of the last axis (..., n); plain mean of fewer than four values."""
    return np.asarray(stats.trim_mean(values, 0.25, axis=-1), np.float64)


class Bootstrapped(NamedTuple):
    """A statistic with its interval."""

    value: float
    low: float
    high: float

    def named(self, name: str) -> dict[str, float]:
        return {name: self.value, f"{name}_low": self.low, f"{name}_high": self.high}


def bootstrapped(value: float | NDArray[np.float64], resampled: NDArray[np.float64]) -> Bootstrapped:
    """A statistic with its interval from its values over resamples (n,), which may be infinite."""
    low, high = np.quantile(resampled, ENDS, method="nearest")
    return Bootstrapped(float(value), float(low), float(high))
