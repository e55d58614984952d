"""The smallest task with a mirror image: unit masses on a line, rewarded for resting at zero."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv

from iowbc.robot.mirror import MirrorMap

MIRRORS = (
    MirrorMap(np.array([0, 1]), np.array([-1, -1], np.float32)),
    MirrorMap(np.array([0]), np.array([-1], np.float32)),
)


class PointMasses(VecEnv):  # type: ignore[misc]
    """Eight masses; observations are position and velocity, actions are forces, episodes never end."""

    def __init__(self) -> None:
        super().__init__(8, spaces.Box(-np.inf, np.inf, (2,)), spaces.Box(-1, 1, (1,)))
        self.masses = np.tile(np.linspace(-1, 1, 8)[:, None], (1, 2)).astype(np.float32)

    def reset(self) -> Any:
        return self.masses.copy()

    def step_async(self, actions: Any) -> None:
        self.masses[:, 1] = 0.9 * self.masses[:, 1] + 0.2 * actions[:, 0]
        self.masses[:, 0] += 0.2 * self.masses[:, 1]

    def step_wait(self) -> Any:
        reward = -(self.masses**2).sum(1)
        return self.masses.copy(), reward, np.zeros(8, np.bool_), [{} for _ in range(8)]

    def statistics(self) -> dict[str, float]:
        return {"distance": float(np.abs(self.masses[:, 0]).mean())}

    def state(self) -> dict[str, Any]:
        return {"masses": self.masses.copy()}

    def restore(self, state: Mapping[str, Any]) -> None:
        self.masses[:] = state["masses"]

    def close(self) -> None: ...
    def get_attr(self, name: str, indices: Any = None) -> Any:
        return [None] * 8

    def set_attr(self, name: str, value: Any, indices: Any = None) -> None: ...
    def env_method(self, name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any: ...
    def env_is_wrapped(self, wrapper: Any, indices: Any = None) -> Any:
        return [False] * 8
