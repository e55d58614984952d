"""The running mean of the policies of a training."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from torch import nn

from iowbc.learning.checkpoint import Arrays, module_arrays

ACTS = ("actor.", "log_stds")
"""How the names of an `ActorCritic`'s arrays begin that decide how it acts."""


class PolicyAverage:
    """Exponentially weighted mean of weights and standard deviations."""

    def __init__(self, policy: nn.Module, half_life: float) -> None:
        """`half_life`: updates in which the weight of a policy in the mean halves."""
        self.newest = 1.0 - 0.5 ** (1.0 / half_life)
        """Weight of the newest policy."""
        self.arrays: Arrays = acting_part(module_arrays(policy))

    def take(self, policy: nn.Module) -> None:
        """Takes the newest policy into account."""
        newest = acting_part(module_arrays(policy))
        self.arrays = {
            name: mean + np.float32(self.newest) * (newest[name] - mean) for name, mean in self.arrays.items()
        }

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Goes on from this mean."""
        self.arrays = acting_part(arrays)


def acting_part(arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    """Those arrays of an `ActorCritic` that decide how it acts."""
    return {name: value for name, value in arrays.items() if name.startswith(ACTS)}
