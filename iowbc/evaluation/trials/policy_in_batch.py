"""A policy that computes in the shape of a larger batch."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iowbc.learning.acting import Policy

if TYPE_CHECKING:
    import pandas as pd


class PolicyInBatch:
    """A policy for some environments that computes in the shape of a larger batch, with them at given places.

    Matrix products round differently for other shapes; with this, a trial is the same bit for bit whichever trials of
    its sweep it is played with.
    """

    def __init__(self, policy: Policy, size: int, places: NDArray[np.int64]) -> None:
        """`places` (n,): the environments' rows in the batch of `size`."""
        self.policy, self.size, self.places = policy, size, places

    def reset(self, which: NDArray[np.bool_]) -> None:
        self.policy.reset(self._spread(which))

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        return self.policy.act(self._spread(observation), self._spread(privileged))[self.places]

    def _spread(self, rows: NDArray[Any]) -> NDArray[Any]:
        batch = np.zeros((self.size, *rows.shape[1:]), rows.dtype)
        batch[self.places] = rows
        return batch


def in_batch(policy: Policy, row: "pd.Series[Any]") -> PolicyInBatch:
    """The policy as it acted in the trial of a row of the long table, for that trial alone."""
    return PolicyInBatch(policy, int(row["batch_size"]), np.array([int(row["batch_row"])]))
