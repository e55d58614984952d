"""Rollouts of many environments: the policies that act, with exploration noise or teachers, and what is recorded.

The policies are sent to the environments' processes.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Protocol, Self

import numpy as np

from iowbc.arrays import Array, Indices, Mask
from iowbc.rollouts.blocks import in_blocks
from iowbc.rollouts.policies import History, HistoryPolicy, RowPolicy

Decision = tuple[Array, Mapping[str, Array]]
"""The action, (n, A), and further records by name, (n, ...)."""


@dataclass(frozen=True)
class Past:
    """Observations before a rollout."""

    frames: Array
    """(n, K, S), oldest first; the oldest is not used."""
    starts: Mask
    """Environments in which an episode begins, so that `frames` are ignored, (n,)."""

    def of(self, first: int, last: int) -> "Past":
        """The part of environments `first` to `last`, the latter excluded."""
        return Past(self.frames[first:last], self.starts[first:last])

    @cached_property
    def history(self) -> History:
        """A history that starts with `frames`, to which the policy appends."""
        history = History(*self.frames.shape)
        history.frames[:] = self.frames
        return history


@dataclass(frozen=True)
class ExploringPolicy:
    """Policy with exploration noise. With `past`, its input is the history of s_t, the first part of a row."""

    policy: RowPolicy | HistoryPolicy
    noise: Array
    """Added to the mean action, (T, n, A)."""
    block: int
    """Size of the blocks of environments, see `iowbc.rollouts.blocks`."""
    past: Past | None = None

    @property
    def starts(self) -> Mask:
        """Environments whose episode begins with the first row, (n,)."""
        return np.zeros(self.noise.shape[1], np.bool_) if self.past is None else self.past.starts

    def part(self, first: int, last: int) -> Self:
        """The policy for environments `first` to `last`, the latter excluded; `first` starts a block."""
        past = None if self.past is None else self.past.of(first, last)
        return replace(self, noise=self.noise[:, first:last], past=past)

    def act(self, step: int, rows: Array, starts: Mask) -> Decision:
        """The decision for rows (n, S); `starts`: environments whose episode begins with them, (n,)."""
        seen = rows
        if self.past is not None:
            seen = self.past.history.push(rows[:, : self.past.frames.shape[2]], starts)
        return in_blocks(self.policy, self.block, seen) + self.noise[step], {}


@dataclass(frozen=True)
class DaggerPolicy:
    """A student, and teachers that label every step with their own action and act in some of the environments."""

    student: HistoryPolicy
    teachers: tuple[RowPolicy | HistoryPolicy, ...]
    """Those of a history receive the student's."""
    observation: slice
    privileged: slice
    """Places of s_t and of s_priv in a row."""
    masked: Indices
    """Indices in a row that are masked for the teachers, which receive the mean there."""
    teacher_of: Indices
    """Index of each environment's teacher, (n,)."""
    taught: Mask
    """Environments in which the teacher acts, (n,)."""
    block: int
    past: Past

    @property
    def starts(self) -> Mask:
        return self.past.starts

    def part(self, first: int, last: int) -> Self:
        own = slice(first, last)
        return replace(self, teacher_of=self.teacher_of[own], taught=self.taught[own], past=self.past.of(first, last))

    def act(self, step: int, rows: Array, starts: Mask) -> Decision:
        """See `ExploringPolicy.act`. Records `own`, the student's action, and `answer`, the teacher's, (n, A) each."""
        history = self.past.history.push(rows[:, self.observation], starts)
        answer = self._answer(0, rows, history)
        for place in range(1, len(self.teachers)):
            own = self.teacher_of == place
            if own.any():
                answer[own] = self._answer(place, rows, history)[own]
        own = in_blocks(self.student, self.block, history)
        return np.where(self.taught[:, None], answer, own), {"own": own, "answer": answer}

    def _answer(self, place: int, rows: Array, history: Array) -> Array:
        """Actions of one teacher in every environment, (n, A), computed in blocks."""
        teacher, seen = self.teachers[place], rows.copy()
        if isinstance(teacher, HistoryPolicy):
            return in_blocks(teacher, self.block, history)
        seen[:, self.masked] = teacher.normal.mean[self.masked]
        seen = np.concatenate([seen[:, self.observation], seen[:, self.privileged]], axis=1)
        return in_blocks(teacher, self.block, seen)


RolloutPolicy = ExploringPolicy | DaggerPolicy
"""Policy that acts in n environments during one rollout."""


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
