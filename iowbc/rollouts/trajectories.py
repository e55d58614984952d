"""Rollouts of many environments and the trajectories that they record."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.rollouts.rollout_policies import RolloutPolicy


class StepBuffers(Protocol):
    """n environments that read actions from their buffers and write the results there."""

    @property
    def buffers(self) -> Any:
        """By name `action` (n, A), `observation` and `terminal_observation` (n, S), `reward`, `done` and `truncated`
        (n,); where an episode ended, `observation` is of the next one."""

    def step(self) -> None:
        """One control step of every environment; environments whose episode ends are reset."""


@dataclass(frozen=True)
class Trajectories:
    """T steps of n environments."""

    observation: Array
    """Rows before each step and after the last one, (T + 1, n, S)."""
    action: Array
    reward: Array
    """(T, n, A) and (T, n)."""
    ended: Mask
    """True where an episode ended with the step, (T, n)."""
    cut: Array
    """Step and environment of each episode truncated by its time limit, (k, 2), in order."""
    cut_observation: Array
    """The last row of those episodes, (k, S)."""
    records: Mapping[str, Array]
    """Further records of the policy, (T, n, ...) by name."""
    acting: float
    """Time spent in the policy [s], mean over parallel workers."""


def roll(environments: StepBuffers, rollout_policy: RolloutPolicy, steps: int) -> Trajectories:
    """Make a rollout of `steps` steps. Raises ValueError if an action is not finite."""
    buffers, acting = environments.buffers, 0.0
    observations, actions, rewards, ends = [], [], [], []
    records: list[Mapping[str, Array]] = []
    cut: list[tuple[int, int]] = []
    cut_off: list[Array] = []
    starts = rollout_policy.starts
    for step in range(steps):
        began = time.perf_counter()
        observations.append(buffers["observation"].copy())
        action, beside = rollout_policy.act(step, observations[-1], starts)
        wrong = np.flatnonzero(~np.isfinite(action).all(axis=1))
        if len(wrong):
            which = f"environments {wrong.tolist()} of the {len(action)} here"
            raise ValueError(f"actions of {which} are not finite, the first is {action[wrong[0]]}")
        buffers["action"][:] = action
        acting += time.perf_counter() - began
        environments.step()
        actions.append(action)
        records.append(beside)
        rewards.append(buffers["reward"].copy())
        ends.append(starts := buffers["done"].copy())
        for index in np.flatnonzero(starts & buffers["truncated"]).tolist():
            cut.append((step, index))
            cut_off.append(buffers["terminal_observation"][index].copy())
    observations.append(buffers["observation"].copy())
    return Trajectories(
        observation=np.stack(observations),
        action=np.stack(actions),
        reward=np.stack(rewards),
        ended=np.stack(ends),
        cut=np.array(cut, np.int64).reshape(-1, 2),
        cut_observation=np.array(cut_off, np.float32).reshape(len(cut), observations[0].shape[1]),
        records={name: np.stack([beside[name] for beside in records]) for name in records[0]},
        acting=acting,
    )


def side_by_side(parts: Sequence[Trajectories]) -> Trajectories:
    """Join the trajectories of consecutive groups of environments."""
    if len(parts) == 1:
        return parts[0]
    offsets = np.cumsum([0, *(part.reward.shape[1] for part in parts[:-1])])
    cut = np.concatenate([part.cut + np.array([0, offset]) for part, offset in zip(parts, offsets, strict=True)])
    order = np.lexsort((cut[:, 1], cut[:, 0]))
    whole = ("observation", "action", "reward", "ended")
    return Trajectories(
        **{name: np.concatenate([getattr(part, name) for part in parts], axis=1) for name in whole},
        cut=cut[order],
        cut_observation=np.concatenate([part.cut_observation for part in parts])[order],
        records={name: np.concatenate([part.records[name] for part in parts], axis=1) for name in parts[0].records},
        acting=float(np.mean([part.acting for part in parts])),
    )
