"""Rollouts of given episodes with a policy: the signals of every step."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import Array
from iowbc.errors import Interrupted
from iowbc.learning.acting import Policy
from iowbc.task.episodes import Episode
from iowbc.task.record.signals import RECORDED, Trace
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

if TYPE_CHECKING:
    import pandas as pd

INTERRUPT_CHECK_INTERVAL = 25
"""Control steps between checks for an interrupt."""
FAILURES = {"fallen": "fell", "dropped": "dropped"}
"""Endings by the signals that report them, the graver one first."""


@dataclass(frozen=True)
class Outcome:
    """Signals and termination of one episode."""

    trace: Trace
    seconds: float
    """Duration until the end [s]."""
    ending: str
    """One of `FAILURES`, "finished" at the time limit, or "diverged" if the simulation stopped without any of these."""
    drawn: Mapping[str, Array]
    """Random draws by name, each of shape (k,)."""

    @property
    def survived(self) -> bool:
        return self.ending == "finished"


def playing(world: Specification, episodes: Sequence[Episode], workers: int = 0) -> "closing[VectorEnv]":
    """Environments that play these episodes, one each, and are closed with the block."""
    return closing(VectorEnv(world, num_envs=len(episodes), workers=workers, seed=0, episodes=tuple(episodes)))


def play_episodes(
    world: Specification,
    episodes: Sequence[Episode],
    policy: Policy,
    *,
    workers: int,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
) -> list[Outcome]:
    """Play each episode to its end; returns the outcomes in order, independent of `workers`. `progress` receives the
    time reached within the episodes [s]. Raises Interrupted once `interrupted()` is true."""
    with playing(world, episodes, workers) as environment:
        return play_in(environment, policy, interrupted, progress)


def play_in(
    environment: VectorEnv,
    policy: Policy,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
    look: Callable[[float], None] = lambda seconds: None,
) -> list[Outcome]:
    """Play the episodes of an existing environment; see `play_episodes`. `look` receives the time [s] after the reset
    and after each step until the first episode ends."""
    count, dt = environment.num_envs, environment.period
    layout = environment.layout
    observation = environment.reset()
    drawn = {name: np.array(values, np.float64).reshape(count, -1) for name, values in environment.drawn().items()}
    policy.reset(np.ones(count, np.bool_))
    frames: list[dict[str, Array]] = []
    length = np.zeros(count, np.int64)
    endings: dict[int, str] = {}
    look(0.0)
    while not length.all():
        if len(frames) % INTERRUPT_CHECK_INTERVAL == 0:
            if interrupted():
                raise Interrupted(f"stopped after {len(frames) * dt:.1f} s of {count} episodes")
            progress(len(frames) * dt)
        action = policy.act(observation[:, layout.observation], observation[:, layout.privileged])
        observation, _, ended, infos = environment.step(action)
        done = np.asarray(ended, np.bool_)
        frames.append({name: np.array(environment.signals[name], np.float64) for name in RECORDED})
        if not (length[0] or done[0]):
            look(len(frames) * dt)
        for index in np.flatnonzero(done & (length == 0)).tolist():
            length[index] = len(frames)
            failures = [word for name, word in FAILURES.items() if environment.signals[name].flat[index] > 0]
            other = "finished" if infos[index].get("TimeLimit.truncated") else "diverged"
            endings[index] = next(iter(failures), other)
        if done.any():
            policy.reset(done)
    recorded = {name: np.stack([frame[name].reshape(count, -1) for frame in frames]) for name in RECORDED}
    return [
        Outcome(
            trace=trace_of({name: values[: length[index], index] for name, values in recorded.items()}, dt),
            seconds=float(length[index] * dt),
            ending=endings[index],
            drawn={name: values[index] for name, values in drawn.items()},
        )
        for index in range(count)
    ]


def trace_of(rows: Mapping[str, Array], dt: float) -> Trace:
    """Trace of one environment, from signals of shape (T, k) by name."""
    return Trace(dt=dt, **{name: row if row.shape[1] > 1 else row[:, 0] for name, row in rows.items()})


class PolicyInBatch:
    """Policy for some environments, evaluated in a batch of fixed size with these environments in given rows. The
    rounding of matrix products depends on their shape: at a fixed size, a trial is bit-identical whichever others are
    in its batch."""

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
