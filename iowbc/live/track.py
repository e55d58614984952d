"""Episodes of a page, their recorded moments, and replays of evaluated trials."""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from iowbc.arrays import Array
from iowbc.evaluation.films import Actor
from iowbc.evaluation.trials.errors import deviations_from_clamped
from iowbc.evaluation.trials.interaction import load_metrics
from iowbc.evaluation.trials.metrics import replayed
from iowbc.evaluation.trials.rollout import in_batch, play_in, playing, trace_of
from iowbc.live.drag import Drag
from iowbc.live.drawing import VIEW, GameMarks
from iowbc.live.moment import Moment, MomentRecorder
from iowbc.recipe.evaluation.evaluation import Success
from iowbc.robot.description import GRAVITY, Robot
from iowbc.task.record.signals import RECORDED
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

PAST = 60.0
"""Length of the past of an episode that is kept, and can be looked at [s]."""
WINDOW = 3.0
"""Figures are means over so long a time [s]; the weight in the hands leaves out its first second."""


class Track:
    """The moments of a recorder's present episode, one a control step."""

    def __init__(self, recorder: MomentRecorder, world: Specification, title: str, kept: int | None = None) -> None:
        """`kept`: how many of the last moments it keeps."""
        self.title, self.model, self.period = title, recorder.model, recorder.batch.period
        self.moments: deque[Moment] = deque(maxlen=kept)
        self.ending = ""
        """Reason of the episode's end; empty before it."""
        self.held_weight = GRAVITY * recorder.held_mass
        """Weight of a held object [N]; 0 without one."""
        self._gait_period = 1.0 / world.recipe.task.references.gait.frequency
        self._joints = recorder.batch.robot.joints

    @property
    def end(self) -> float:
        """Time of the last moment [s]."""
        return self.moments[-1].seconds

    def place(self, seconds: float) -> int:
        """Index of the moment nearest to a time [s]."""
        steps = round((seconds - self.moments[0].seconds) / self.period)
        return int(np.clip(steps, 0, len(self.moments) - 1))

    def latest(self, place: int) -> list[Moment]:
        """The moments of the `WINDOW` that ends at an index."""
        first = max(0, place + 1 - round(WINDOW / self.period))
        return [self.moments[index] for index in range(first, place + 1)]

    def readings(self, place: int) -> tuple[dict[str, float], dict[str, float]]:
        """Means over the `WINDOW` that ends at an index: the paper's errors relative to the clamped command and
        `weight_in_hands`, NaN where nothing is to be measured; and the part of the time at the torque limit, of the
        joints that ever were."""
        seen = self.latest(place)
        signals = {name: np.stack([moment.signals[name] for moment in seen])[:, None] for name in RECORDED}
        trace = trace_of(signals, 0, len(seen), self.period)
        deviations = deviations_from_clamped(trace, max(1, round(self._gait_period / self.period)))
        load = load_metrics(trace, self.held_weight, self.held_weight > Success().least_weight)
        shares = zip(self._joints, trace.joint_saturation.mean(axis=0).tolist(), strict=True)
        return deviations.means() | load, {name: share for name, share in shares if share > 0}


class Played(ABC):
    """Episodes for a page, to be closed."""

    track: Track
    """Record of the current episode."""
    request: Any
    """The conditions of the episode, as `begin` takes them."""
    robot: Robot
    period: float
    """Time of a step [s]."""
    marks: GameMarks | None = None
    """Path, walls and handle of a game."""
    view = VIEW
    """Initial position and target of a camera [m]."""
    checkpoint = ""
    """Text about the checkpoint in use, if the policy is in training."""

    def begin(self, request: Any) -> None:
        """A new episode under other conditions."""
        self.close()
        self._open(request)

    @abstractmethod
    def _open(self, request: Any) -> None:
        """Sets up the simulation of an episode."""

    @abstractmethod
    def reset(self) -> None:
        """Restart the episode."""

    @abstractmethod
    def step(self) -> None:
        """One control period. After an episode's end, which `track.ending` names, nothing moves until a reset."""

    @abstractmethod
    def drag(self, drags: Sequence[Drag]) -> None:
        """Apply mouse drags until the next call."""

    @abstractmethod
    def close(self) -> None:
        """Ends the simulation."""

    def refresh(self) -> None:  # noqa: B027 (a game has no checkpoint)
        """Reload the policy if it is a checkpoint that was rewritten."""


def recorded(environment: VectorEnv) -> dict[str, Array]:
    """The signals of an environment that a trial records, by name, (1, k)."""
    return {name: environment.signals[name] for name in RECORDED}


def trial_title(row: "pd.Series[Any]") -> str:
    """A title for a row of `trials.parquet`: the trial's conditions and end."""
    push = f", push {row['impulse']:g} N·s" if row["impulse"] else ""
    case = row["suite"] if row["suite"] == row["case"] else f"{row['suite']}: {row['case']}"
    return f"{case}, {row['mass']:g} kg{push}, trial {row['trial']}: {row['end']} after {row['seconds']:.1f} s"


def played_again(
    actor: Actor, row: "pd.Series[Any]", interrupted: Callable[[], bool], progress: Callable[[float], None]
) -> Track:
    """The trial of a row of the actor's table, step by step; progress: receives the time reached within the trial [s].
    Raises Interrupted once `interrupted()` is true."""
    seen: list[Moment] = []
    with playing(actor.world, [replayed(row)]) as environment:
        recorder, policy = MomentRecorder(environment.batch, recorded(environment)), in_batch(actor.policy, row)
        look = recorder.look
        outcome = play_in(environment, policy, interrupted, progress, lambda seconds: seen.append(look(seconds)))[0]
        track = Track(recorder, actor.world, trial_title(row))
        track.ending = outcome.ending
        track.moments.extend(seen)
        return track
