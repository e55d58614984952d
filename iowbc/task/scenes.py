"""Which environment plays which scene."""

import numpy as np

from iowbc.recipe.task.task import SceneShares


def scene_of(count: int, shares: SceneShares) -> list[str]:
    """Scene of each of `count` environments, in the recipe's shares rounded to whole environments.

    Environments of one scene follow one another: most worker processes then hold one scene alone, and their arrays are
    copied as a block.
    """
    names = [name for name, _ in shares]
    weights = np.array([share for _, share in shares])
    wanted = count * weights / weights.sum()
    whole = np.floor(wanted + 1e-9).astype(int)
    short = np.argsort(-(wanted - whole), kind="stable")[: count - whole.sum()]
    whole[short] += 1
    return [name for name, number in zip(names, whole.tolist(), strict=True) for _ in range(number)]
