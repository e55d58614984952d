"""The observation history H_t = {s_{t-k}, ..., s_t} of many environments."""

import numpy as np
from numpy.typing import NDArray


class History:
    """The last K observations of n environments, shape (n, K, S), oldest first.

    An episode begins with K copies of its first observation.
    """

    def __init__(self, environments: int, length: int, observation: int) -> None:
        self.frames: NDArray[np.float32] = np.zeros((environments, length, observation), np.float32)

    def push(self, observation: NDArray[np.float32], starts: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Append s_t, shape (n, S), or refill the history with it where `starts`; returns H_t, shape (n, K, S)."""
        self.frames[:, :-1] = self.frames[:, 1:]
        self.frames[:, -1] = observation
        self.frames[starts] = observation[starts, None]
        return self.frames
