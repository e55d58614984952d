"""Interface between learners and environments, and environments that show the history of the observations."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper

from iowbc.rollouts.policies import History
from iowbc.rollouts.rollout import ExploringPolicy, Past, RolloutPolicy, Trajectories


class Environments(Protocol):
    """Vector environment of stable-baselines3 that makes whole rollouts and can be saved, such as `VectorEnv`."""

    num_envs: int
    observation_space: Any
    action_space: Any

    def reset(self) -> NDArray[np.float32]:
        """Start an episode in every environment; returns observations, (num_envs, size)."""

    def roll(self, rollout_policy: RolloutPolicy, steps: int) -> Trajectories:
        """Make a rollout of `steps` control steps."""

    def copy(self, source: NDArray[np.int64]) -> NDArray[np.float32]:
        """Each environment continues from the state of environment `source`, (num_envs,); returns observations."""

    def statistics(self) -> dict[str, float]:
        """Statistics since the last call."""

    def state(self) -> dict[str, NDArray[Any]]:
        """Complete state, for a checkpoint."""

    def restore(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Inverse of `state`."""


class HistoryEnvironments(VecEnvWrapper):  # type: ignore[misc]
    """Wrapper that turns rows (s_t, s_priv) of a vector environment into rows of H_t, oldest first, and s_priv."""

    def __init__(self, environments: Any, observation: int, length: int) -> None:
        """`observation`: size of s_t, the first part of a row; `length`: observations in a history."""
        (size,) = environments.observation_space.shape
        self._size, self._length = observation, length
        self._history = History(environments.num_envs, length, observation)
        width = length * observation + size - observation
        super().__init__(environments, observation_space=spaces.Box(-np.inf, np.inf, (width,), np.float32))

    def reset(self) -> NDArray[np.float32]:
        """Start an episode in every environment; returns the first rows."""
        row = self.venv.reset()
        return self._rows(row, np.ones(len(row), np.bool_))

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step as in the wrapped environments; the last observation of an episode includes its history."""
        row, rewards, dones, infos = self.venv.step_wait()
        for index in np.flatnonzero(dones).tolist():
            infos[index]["terminal_observation"] = self._last_row(index, infos[index]["terminal_observation"])
        return self._rows(row, dones), rewards, dones, infos

    def roll(self, rollout_policy: ExploringPolicy, steps: int) -> Trajectories:
        """Make a rollout of `steps` control steps; policy and returned trajectories use rows with histories."""
        before = np.roll(self._history.frames, 1, axis=1)  # the policy appends the newest observation itself
        past = Past(before, np.zeros(self.num_envs, np.bool_))
        found: Trajectories = self.venv.roll(replace(rollout_policy, past=past), steps)
        rows = np.empty((steps + 1, self.num_envs, *self.observation_space.shape), np.float32)
        last = np.empty((len(found.cut), rows.shape[2]), np.float32)
        rows[0] = self._beside(self._history.frames, found.observation[0])
        for step in range(steps):
            for place in np.flatnonzero(found.cut[:, 0] == step):
                last[place] = self._last_row(found.cut[place, 1], found.cut_observation[place])
            rows[step + 1] = self._rows(found.observation[step + 1], found.ended[step])
        return replace(found, observation=rows, cut_observation=last)

    def _last_row(self, index: int, last: NDArray[np.float32]) -> NDArray[np.float32]:
        """Row with history for the `last` observation of an episode in environment `index`."""
        past = self._history.frames[index, 1:].ravel()
        return np.concatenate([past, last]).astype(np.float32)

    def _rows(self, row: NDArray[np.float32], starts: NDArray[np.bool_]) -> NDArray[np.float32]:
        return self._beside(self._history.push(row[:, : self._size], starts), row)

    def _beside(self, frames: NDArray[np.float32], row: NDArray[np.float32]) -> NDArray[np.float32]:
        """Rows of histories followed by s_priv."""
        return np.concatenate([frames.reshape(len(row), -1), row[:, self._size :]], axis=1)

    def copy(self, source: NDArray[np.int64]) -> NDArray[np.float32]:
        self._history.frames[:] = self._history.frames[source]
        return self._beside(self._history.frames, self.venv.copy(source))

    def state(self) -> dict[str, NDArray[Any]]:
        return self.venv.state() | {"history": self._history.frames.copy()}

    def restore(self, state: Mapping[str, NDArray[Any]]) -> None:
        self._history.frames[:] = state["history"]
        self.venv.restore({name: values for name, values in state.items() if name != "history"})
