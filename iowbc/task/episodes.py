"""Planned episodes: scene, seed, fixed quantities, scripted commands, pushes on the base and pulls on the object."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from iowbc.arrays import Array, Indices
from iowbc.control.command import COMMAND
from iowbc.robot.rotations import turned


@dataclass(frozen=True)
class CommandSegment:
    """Segment of a sequence: the command moves to `command` over `ramp` and then holds."""

    duration: float
    """Duration of the segment, its ramp included [s]."""
    command: tuple[float, ...]
    """The 11 values that hold at the segment's end."""
    ramp: float = 0.0
    """Duration of the linear transition from the previous segment's values [s]."""

    def __post_init__(self) -> None:
        if len(self.command) != len(COMMAND):
            raise ValueError(f"a command has {len(COMMAND)} values ({', '.join(COMMAND)}), got {len(self.command)}")
        if not np.all(np.isfinite(self.command)):
            raise ValueError(f"a command must be finite, got {self.command}")
        if not 0.0 <= self.ramp <= self.duration:
            raise ValueError(f"ramp must lie between 0 and the duration of {self.duration} s, got {self.ramp} s")


@dataclass(frozen=True)
class CommandScript:
    """Segments in order, the same for all policies under comparison; after the last one its command holds. The first
    segment starts at its own command."""

    segments: tuple[CommandSegment, ...]

    def __post_init__(self) -> None:
        if not self.segments:
            raise ValueError("a command script needs at least one segment")

    @property
    def duration(self) -> float:
        """Total time of the segments [s]."""
        return sum(segment.duration for segment in self.segments)

    def at(self, time: float | Array) -> Array:
        """The commands at times from the start (...) [s], shape (..., 11)."""
        times, values = self.knots()
        return np.stack([np.interp(time, times, column) for column in values.T], axis=-1)

    def knots(self) -> tuple[Array, Array]:
        """The piecewise linear command as times (k,) [s] and values (k, 11)."""
        times, values = [0.0], [np.array(self.segments[0].command)]
        start = 0.0
        for segment in self.segments:
            target = np.array(segment.command)
            times += [start + segment.ramp, start + segment.duration]
            values += [target, target]
            start += segment.duration
        return np.array(times), np.array(values)


@dataclass(frozen=True)
class PlannedPush:
    """A push on the base at a set time."""

    time: float
    """When it begins [s]."""
    duration: float
    """Time over which it acts, as a constant force [s]."""
    impulse: tuple[float, float]
    """Forward and to the left of the commanded heading [N·s]."""


@dataclass(frozen=True)
class PlannedPull:
    """A sinusoidal force on the object's centre of mass, f sin(2π ν (t - begin))."""

    begin: float
    """[s]."""
    duration: float
    """[s]."""
    frequency: float
    """ν [Hz]."""
    force: tuple[float, float]
    """Amplitude, forward and to the left of the commanded heading [N]."""

    @property
    def direction(self) -> str:
        """The nearer axis: "forward" or "left"."""
        forward, left = self.force
        return "forward" if abs(forward) >= abs(left) else "left"


@dataclass(frozen=True)
class Episode:
    """A trial. Everything random in it follows from its seed, so that every policy meets the same trial."""

    scene: str
    seed: int
    """Seed of all that is drawn in the episode."""
    duration: float
    """Time limit [s]."""
    fixed: Mapping[str, float] = field(default_factory=dict)
    """Randomised quantities held at a value, by name."""
    script: CommandScript | None = None
    """The commands; None draws them as in training."""
    push: PlannedPush | None = None
    """A push on the base in addition to the drawn ones."""
    pull: PlannedPull | None = None
    """A pull on the object."""

    def __post_init__(self) -> None:
        if self.duration <= 0.0:
            raise ValueError(f"an episode lasts a positive time, got {self.duration} s")
        if self.seed < 0:
            raise ValueError(f"an episode's seed is not negative, got {self.seed}")

    def as_json(self) -> dict[str, Any]:
        segments = self.script.segments if self.script is not None else ()
        script = [{"duration": s.duration, "ramp": s.ramp, "command": list(s.command)} for s in segments]
        return asdict(self) | {"script": script or None}

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> "Episode":
        script = None if values["script"] is None else {"segments": values["script"]}
        return EPISODE.validate_python({**values, "script": script})


EPISODE = TypeAdapter(Episode)


class PlannedPushes:
    """Forces on the bases of n environments over the control periods of their pushes."""

    def __init__(self, pushes: Sequence[PlannedPush | None], period: float) -> None:
        """`period`: control period [s]."""
        self.any = any(push is not None for push in pushes)
        planned = [push or PlannedPush(np.inf, period, (0.0, 0.0)) for push in pushes]
        length = np.array([max(1, round(push.duration / period)) for push in planned])
        self._first = np.array([np.round(push.time / period) for push in planned])
        self._last = self._first + length
        self._strength = np.array([push.impulse for push in planned]) / (length * period)[:, None]

    def force(self, step: Indices, heading: Array) -> Array:
        """World force over the period that begins at `step` (n,), (n, 3) [N]; `heading`: commanded, (n,) [rad]."""
        forward, left = (self._strength * ((step >= self._first) & (step < self._last))[:, None]).T
        return in_world(forward, left, heading)


class PlannedPulls:
    """Sinusoidal forces on the objects of n environments."""

    def __init__(self, pulls: Sequence[PlannedPull | None], period: float) -> None:
        """`period`: control period [s]."""
        self.any = any(pull is not None for pull in pulls)
        planned = [pull or PlannedPull(np.inf, 0.0, 1.0, (0.0, 0.0)) for pull in pulls]
        self._begin = np.array([pull.begin for pull in planned])
        self._end = self._begin + np.array([pull.duration for pull in planned])
        self._rate = 2.0 * np.pi * np.array([pull.frequency for pull in planned])
        self._force = np.array([pull.force for pull in planned])
        self._period = period

    def force(self, step: Indices, heading: Array) -> Array:
        """World force in the middle of the period that begins at `step` (n,), (n, 3) [N]; `heading` as of a push."""
        time = (step + 0.5) * self._period
        acting = (time > self._begin) & (time < self._end)
        size = np.where(acting, np.sin(self._rate * np.where(acting, time - self._begin, 0.0)), 0.0)
        forward, left = (self._force * size[:, None]).T
        return in_world(forward, left, heading)


def in_world(forward: Array, left: Array, heading: Array) -> Array:
    """Horizontal vectors of a heading frame as world vectors, (n, 3)."""
    return turned(np.stack([forward, left, np.zeros(len(heading))], axis=1), heading)
