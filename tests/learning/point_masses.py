"""The smallest task with a mirror image: unit masses on a line, rewarded for resting at zero."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv

from iowbc.recipe.teacher import Teacher
from iowbc.robot.mirror import MirrorMap
from iowbc.rollouts.rollout import RolloutPolicy, Trajectories, roll

MIRRORS = (
    MirrorMap(np.array([0, 1, 2]), np.array([-1, -1, 1], np.float32)),
    MirrorMap(np.array([0]), np.array([-1], np.float32)),
)

SETTINGS = Teacher(
    steps=16 * 8 * 6,
    environments=8,
    rollout=16,
    minibatches=2,
    hidden=(16,),
    learning_rate=1e-3,
    gamma=0.9,
    precision="float32",
    std_learning_rate=1e-2,
)
"""With which a training learns it in seconds."""


class PointMasses(VecEnv):  # type: ignore[misc]
    """Eight masses; observations are position, velocity and distance, episodes are cut off after 20 steps."""

    def __init__(self) -> None:
        super().__init__(8, spaces.Box(-np.inf, np.inf, (3,)), spaces.Box(-1, 1, (1,)))
        self.start = np.tile(np.linspace(-1, 1, 8)[:, None], (1, 2)).astype(np.float32)
        self.masses, self.age, self.total = self.start.copy(), np.arange(8), np.zeros(2)

    def observed(self) -> Any:
        return np.concatenate([self.masses, np.abs(self.masses[:, :1])], axis=1)

    def reset(self) -> Any:
        return self.observed()

    def copy(self, source: Any) -> Any:
        self.masses[:], self.age[:] = self.masses[source], self.age[source]
        return self.observed()

    def step_async(self, actions: Any) -> None:
        self.masses[:, 1] = 0.8 * self.masses[:, 1] + 0.4 * actions[:, 0]
        self.masses[:, 0] += 0.2 * self.masses[:, 1]
        self.age += 1

    def step_wait(self) -> Any:
        reward, infos = -(self.masses**2).sum(1), [dict[str, Any]() for _ in range(8)]
        self.total += reward.sum(), reward.size
        ended = self.age >= 20
        for index in np.flatnonzero(ended):
            infos[index] = {"terminal_observation": self.observed()[index], "TimeLimit.truncated": True}
        self.masses[ended], self.age[ended] = self.start[ended], 0
        return self.observed(), reward, ended, infos

    def roll(self, rollout_policy: RolloutPolicy, steps: int) -> Trajectories:
        return roll(Buffered(self), rollout_policy.part(0, 8), steps)

    def statistics(self) -> dict[str, float]:
        mean = self.total[0] / max(self.total[1], 1)
        self.total[:] = 0.0
        return {"reward": float(mean)}

    def state(self) -> dict[str, Any]:
        return {"masses": self.masses.copy(), "age": self.age.copy()}

    def restore(self, state: Mapping[str, Any]) -> None:
        self.masses[:], self.age[:] = state["masses"], state["age"]

    def close(self) -> None: ...
    def get_attr(self, name: str, indices: Any = None) -> Any:
        return [None] * 8

    def set_attr(self, name: str, value: Any, indices: Any = None) -> None: ...
    def env_method(self, name: str, *args: Any, indices: Any = None, **kwargs: Any) -> Any: ...
    def env_is_wrapped(self, wrapper: Any, indices: Any = None) -> Any:
        return [False] * 8


class Buffered:
    """The masses as their rollouts are made."""

    def __init__(self, masses: PointMasses) -> None:
        self.masses = masses
        self.buffers: dict[str, Any] = {"observation": masses.observed(), "action": np.zeros((8, 1), np.float32)}

    def step(self) -> None:
        observation, reward, ended, infos = self.masses.step(self.buffers["action"].clip(-1, 1))
        last = np.stack([info.get("terminal_observation", row) for info, row in zip(infos, observation, strict=True)])
        self.buffers |= {"observation": observation, "reward": reward, "done": ended, "truncated": ended}
        self.buffers["terminal_observation"] = last
