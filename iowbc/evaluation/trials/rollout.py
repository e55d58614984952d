"""Rollouts of given episodes with a policy, with a record of the signals of every step."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import fields

import numpy as np

from iowbc.arrays import Array
from iowbc.errors import Interrupted
from iowbc.evaluation.trials.trace import Outcome, Trace
from iowbc.learning.acting import Policy
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

RECORDED = tuple(field.name for field in fields(Trace) if field.name != "dt")
"""Names of the signals in a trace."""
INTERRUPT_CHECK_INTERVAL = 25
"""Control steps between checks for an interrupt."""


def play_episodes(
    world: Specification,
    episodes: Sequence[Episode],
    policy: Policy,
    *,
    workers: int,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
) -> list[Outcome]:
    """Play each episode to its end; returns the outcomes in order, independent of `workers`.

    progress: receives the time reached within the episodes [s]. Raises Interrupted once `interrupted()` is true.
    """
    count, planned = len(episodes), tuple(episodes)
    with closing(VectorEnv(world, num_envs=count, workers=workers, seed=0, episodes=planned)) as environment:
        return play_in(environment, policy, interrupted, progress)


def play_in(
    environment: VectorEnv,
    policy: Policy,
    interrupted: Callable[[], bool] = lambda: False,
    progress: Callable[[float], None] = lambda seconds: None,
    look: Callable[[float], None] = lambda seconds: None,
) -> list[Outcome]:
    """Play the episodes of an existing environment; see `play_episodes`.

    look: called with the time [s] after the reset and after each step until the first episode ends.
    """
    count, dt = environment.num_envs, environment.period
    layout = environment.layout
    observation = environment.reset()
    drawn = {name: np.array(values, np.float64).reshape(count, -1) for name, values in environment.drawn().items()}
    policy.reset(np.ones(count, np.bool_))
    frames: list[dict[str, Array]] = []
    length = np.zeros(count, np.int64)
    endings = {name: np.zeros(count, np.bool_) for name in ("fallen", "dropped")}
    finished = np.zeros(count, np.bool_)
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
        ends = done & (length == 0)
        length[ends] = len(frames)
        for name, flags in endings.items():
            flags[ends] = environment.signals[name].reshape(count)[ends] > 0
        for index in np.flatnonzero(ends):
            finished[index] = bool(infos[index].get("TimeLimit.truncated", False))
        if done.any():
            policy.reset(done)
    recorded = {name: np.stack([frame[name].reshape(count, -1) for frame in frames]) for name in RECORDED}
    return [
        Outcome(
            trace=trace_of(recorded, index, int(length[index]), dt),
            seconds=float(length[index] * dt),
            fallen=bool(endings["fallen"][index]),
            dropped=bool(endings["dropped"][index]),
            finished=bool(finished[index]),
            drawn={name: values[index] for name, values in drawn.items()},
        )
        for index in range(count)
    ]


def trace_of(recorded: Mapping[str, Array], index: int, steps: int, dt: float) -> Trace:
    """Trace of the first `steps` of one environment, from signals of shape (T, n, k) by name."""
    rows = {name: values[:steps, index] for name, values in recorded.items()}
    return Trace(dt=dt, **{name: row if row.shape[1] > 1 else row[:, 0] for name, row in rows.items()})
