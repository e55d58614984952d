"""Counter-based random numbers: pure functions of (seed, environment, episode, step, stream), vectorised.

Nothing has to be stored to continue a sequence but the counters, and an environment's numbers are the same however the
environments are spread over processes.
"""

import zlib
from functools import cache

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array, Keys
from iowbc.recipe.simulation.randomization import Distribution

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
UNIT = 2.0**-53


def mix(value: Keys) -> Keys:
    """SplitMix64's output function (Steele, Lea, Flood 2014) of value + golden ratio: a scattering bijection."""
    z = value + GOLDEN
    z ^= z >> 30
    z *= 0xBF58476D1CE4E5B9
    z ^= z >> 27
    z *= 0x94D049BB133111EB
    z ^= z >> 31
    return z


def absorb(key: Keys, counter: Array | int) -> Keys:
    """A new key from a key and a counter, any broadcastable shapes."""
    return mix(key ^ mix(np.atleast_1d(counter).astype(np.uint64)))


def environment_key(seed: Array | int, environment: Array) -> Keys:
    """Key of each environment, shape (n,)."""
    return absorb(mix(np.atleast_1d(seed).astype(np.uint64)), environment)


@cache
def _name(stream: str) -> Keys:
    """What keys absorb of a stream's name, (1,)."""
    return mix(np.array([zlib.crc32(stream.encode())], np.uint64))


@cache
def _lanes(width: int) -> Keys:
    """Distances between the words of a row, (width,)."""
    return np.arange(width, dtype=np.uint64) * GOLDEN


def bits(key: Keys, stream: str, width: int) -> Keys:
    """`width` random 64-bit words per key: shape (n,) to (n, width)."""
    return mix(mix(key ^ _name(stream))[:, None] + _lanes(width))


def uniform(key: Keys, stream: str, width: int) -> Array:
    """x ~ U[0, 1), shape (n, width)."""
    unit: Array = (bits(key, stream, width) >> 11) * UNIT
    return unit


def draw(key: Keys, stream: str, distribution: Distribution, width: int = 1) -> Array:
    """x drawn from a recipe's distribution, shape (n, width); `probability` decides once for all of a row."""
    low, high = distribution.low, distribution.high
    if not distribution.enabled:
        return np.full((len(key), width), distribution.nominal)
    if distribution.shape == "log-uniform":
        value = low * (high / low) ** uniform(key, stream, width)
    else:
        value = low + (high - low) * uniform(key, stream, width)
    if distribution.probability < 1.0:
        kept = uniform(key, f"{stream}/drawn", 1) < distribution.probability
        value = np.where(kept, value, distribution.nominal)
    return value


BYTES = np.uint64(0x00FF00FF00FF00FF)
PAIRS = np.uint64(0x0000FFFF0000FFFF)
STEP = np.uint64(0xD1342543DE82EF95)
BYTE_MEAN, BYTE_VARIANCE = 127.5, (256.0**2 - 1.0) / 12.0


def noise(key: Keys, step: NDArray[np.uint64], width: int) -> Array:
    """x ~ nearly N(0, 1) for each environment's step, shape (n, width), width even: sums of four random bytes.

    Mean 0, variance 1, kurtosis 2.7, bounded by 2√3, in steps of 0.007. Several times faster than exact draws.
    """
    word = mix((key + step * STEP)[:, None] + _lanes(width // 2))
    sums = word & BYTES
    word >>= 8
    word &= BYTES
    sums += word
    np.right_shift(sums, 16, out=word)
    sums &= PAIRS
    word &= PAIRS
    sums += word
    deviation = sums.view(np.uint32) - 4.0 * BYTE_MEAN
    deviation *= (4.0 * BYTE_VARIANCE) ** -0.5
    return deviation
