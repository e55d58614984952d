"""A policy that leaves the robot to its reference."""

import numpy as np
from numpy.typing import NDArray


class StandingStill:
    """No residual action, whatever is seen."""

    def reset(self, which: NDArray[np.bool_]) -> None:
        """It has no past."""

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.zeros((len(observation), 15), np.float32)
