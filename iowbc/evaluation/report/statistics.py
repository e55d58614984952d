"""Intervals for what few trials can say.

Trials of one number meet the same world (draws and commands) at every mass, in every suite and with every training:
they are clusters, and what counts is how many worlds there are.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

CONFIDENCE = 0.95
"""Of every interval in tables and figures."""
ENDS = ((1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2)
"""Quantiles between which that part lies."""
RESAMPLES = 2000
"""Of a bootstrap."""


def wilson_interval(successes: int, trials: int, design: float = 1.0) -> tuple[float, float]:
    """Wilson's score interval of a success rate; sensible at 0 and at all of few trials. Raises ValueError.

    design: the trials count as so many times fewer (`design_effect`).
    """
    if not 0 <= successes <= trials or trials == 0:
        raise ValueError(f"{successes} of {trials} is no rate: n trials have 0 to n successes, and n is at least 1")
    rate, count, z = successes / trials, trials / design, float(stats.norm.ppf(ENDS[1]))
    middle = (rate + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * math.sqrt(rate * (1 - rate) / count + z**2 / (4 * count**2))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def standard_error(values: NDArray[np.float64], worlds: NDArray[np.int64] | None = None) -> tuple[float, int]:
    """Standard error of a mean, and the number of clusters that it rests on; NaN for fewer than two of them.

    s² = G / (G - 1) · Σ_g (Σ_i (x_gi - x̄))² / n², the cluster-robust variance: values (n,) of one world may depend on
    each other in any way. Without `worlds` (n,) each value is its own, and s that of the textbook.
    """
    _, places = np.unique(np.arange(len(values)) if worlds is None else worlds, return_inverse=True)
    clusters = int(places.max(initial=-1)) + 1
    if clusters < 2:
        return math.nan, clusters
    sums = np.bincount(places, values - values.mean())
    return float(np.sqrt(clusters / (clusters - 1) * np.sum(np.square(sums)))) / len(values), clusters


def mean_half_width(values: NDArray[np.float64], worlds: NDArray[np.int64] | None = None) -> float:
    """Half the width of Student's interval of a mean; NaN for fewer than two worlds, which say nothing of spread."""
    error, clusters = standard_error(values, worlds)
    return math.nan if clusters < 2 else error * float(stats.t.ppf(ENDS[1], clusters - 1))


def mean_p(values: NDArray[np.float64], worlds: NDArray[np.int64] | None = None) -> float:
    """Student's p of a mean of zero, with worlds as clusters; NaN for fewer than two."""
    error, clusters = standard_error(values, worlds)
    return math.nan if clusters < 2 else float(2.0 * stats.t.sf(abs(values.mean()) / error, clusters - 1))


def sign_flip_p(differences: NDArray[np.int64]) -> float:
    """Exact p of whole differences (worlds,) that might as well have the other sign: McNemar's where all are ±1.

    P(|Σ ±d| >= |Σ d|) over all signs, from the distribution of the sum.
    """
    sizes = np.abs(differences[differences != 0])
    total, observed = int(sizes.sum()), abs(int(differences.sum()))
    chances = functools.reduce(_flipped, sizes.tolist(), np.ones(1))
    sums = np.arange(-total, total + 1)
    return min(1.0, float(chances[np.abs(sums) >= observed].sum()))


def _flipped(chances: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """The distribution of a sum, -k to k, with one more term that is size or -size."""
    return 0.5 * (np.pad(chances, (0, 2 * size)) + np.pad(chances, (2 * size, 0)))


def design_effect(successes: NDArray[np.bool_], worlds: NDArray[np.int64]) -> float:
    """The factor by which fewer independent trials say as much as these (n,), of which some share a world: 1 to the
    trials of a world. Where all went alike, as many as these: trials of one world might always do so."""
    clusters = len(np.unique(worlds))
    most, values = len(successes) / clusters, successes.astype(np.float64)
    if clusters < 2 or not np.ptp(values):
        return most
    ratio = standard_error(values, worlds)[0] / standard_error(values)[0]
    return float(np.clip(ratio**2, 1.0, most))


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


class Bootstrapped(NamedTuple):
    """A statistic with its interval."""

    value: float
    low: float
    high: float

    def named(self, name: str) -> dict[str, float]:
        """Its columns in a table of numbers."""
        return {name: self.value, f"{name}_low": self.low, f"{name}_high": self.high}


def bootstrapped(value: float | NDArray[np.float64], resampled: NDArray[np.float64]) -> Bootstrapped:
    """A statistic with its interval from its values over resamples (n,), which may be infinite."""
    low, high = np.quantile(resampled, ENDS, method="nearest")
    return Bootstrapped(float(value), float(low), float(high))


def root_mean_square(true: NDArray[np.float64], inferred: NDArray[np.float64]) -> float:
    """Of the errors, in the unit of the values."""
    return float(np.sqrt(np.mean(np.square(true - inferred))))
