"""A policy that is evaluated in batches of a fixed size, so that a trial's results do not depend on the others."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iowbc.learning.acting import Policy

if TYPE_CHECKING:
    import pandas as pd


class PolicyInBatch:
    """Policy for some environments, evaluated in a batch of fixed size with these environments in given rows.

    The rounding of matrix products depends on their shape. At a fixed size, a trial is bit-identical whichever other
    trials are in its batch.
    """

    def __init__(self, policy: Policy, size: int, places: NDArray[np.int64]) -> None:
        """`places` (n,): rows of the environments in the batch of `size`."""
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
    """The policy for a single trial, in the batch size and row of its row of the long table."""
    return PolicyInBatch(policy, int(row["batch_size"]), np.array([int(row["batch_row"])]))
