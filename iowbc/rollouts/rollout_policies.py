"""Rollout policies, with exploration noise or teachers. They are sent to the environments' processes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

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

    def history(self) -> History:
        """A history that starts with `frames`."""
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

    @cached_property
    def _history(self) -> History | None:
        return None if self.past is None else self.past.history()

    def act(self, step: int, rows: Array, starts: Mask) -> Decision:
        """The decision for rows (n, S); `starts`: environments whose episode begins with them, (n,)."""
        seen = rows
        if self._history is not None:
            seen = self._history.push(rows[:, : self._history.frames.shape[2]], starts)
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

    @cached_property
    def _history(self) -> History:
        return self.past.history()

    def act(self, step: int, rows: Array, starts: Mask) -> Decision:
        """See `ExploringPolicy.act`. Records `own`, the student's action, and `answer`, the teacher's, (n, A) each."""
        history = self._history.push(rows[:, self.observation], starts)
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
