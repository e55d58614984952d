"""Scripted command sequences: the same for all policies under comparison."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.control.command import COMMAND


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
    """Segments in order; after the last one its command holds. The first segment starts at its own command."""

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

    def as_json(self) -> list[dict[str, Any]]:
        return [{"duration": s.duration, "ramp": s.ramp, "command": list(s.command)} for s in self.segments]
