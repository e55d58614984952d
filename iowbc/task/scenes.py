"""Which environment plays which scene."""

from collections.abc import Iterable

import numpy as np


def scene_of(count: int, shares: Iterable[tuple[str, float]]) -> list[str]:
    """Scene of each of `count` environments, in given shares rounded to whole environments.

    Environments of one scene follow one another: most worker processes then hold one scene alone, and their arrays are
    copied as a block.
    """
    names, given = zip(*shares, strict=True)
    weights = np.array(given)
    wanted = count * weights / weights.sum()
    whole = np.floor(wanted + 1e-9).astype(int)
    short = np.argsort(-(wanted - whole), kind="stable")[: count - whole.sum()]
    whole[short] += 1
    return [name for name, number in zip(names, whole.tolist(), strict=True) for _ in range(number)]
