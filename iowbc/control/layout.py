"""Rows of named parts: place, mirror map and computation of each."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from iowbc.arrays import places
from iowbc.robot.description import Robot
from iowbc.robot.mirror import Kind, MirrorMap, side_by_side

Row = NDArray[np.float32]
Source = TypeVar("Source")
"""Type of the input from which the parts of a row are computed."""
EVERY = slice(None)
"""All environments."""


@dataclass(frozen=True)
class Part(Generic[Source]):
    """A part of a row."""

    name: str
    kind: Kind
    """Its mirror map for a robot, whose length is the part's size."""
    unit: str
    frame: str
    """Frame in which the values are given; "joint" for joint coordinates, "-" where there is none."""
    value: Callable[[Source], Any]
    """Its values, (n, size) or (n,) or of more axes, which are flattened."""


@dataclass(frozen=True)
class Layout(Generic[Source]):
    """Parts of a row in order, for one robot."""

    parts: tuple[Part[Source], ...]
    robot: Robot = field(repr=False, compare=False)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(part.name for part in self.parts)

    @cached_property
    def mirrors(self) -> tuple[MirrorMap, ...]:
        return tuple(part.kind(self.robot) for part in self.parts)

    @cached_property
    def mirror(self) -> MirrorMap:
        """Mirror of a row, (size,), float32."""
        return side_by_side(self.mirrors).as_float32()

    @cached_property
    def size(self) -> int:
        return sum(map(len, self.mirrors))

    @cached_property
    def slices(self) -> dict[str, slice]:
        return places(dict(zip(self.names, map(len, self.mirrors), strict=True)))

    def describe(self) -> list[dict[str, Any]]:
        """Name, size, unit and frame of the parts, in order, for JSON."""
        return [
            {"name": part.name, "size": len(mirror), "unit": part.unit, "frame": part.frame}
            for part, mirror in zip(self.parts, self.mirrors, strict=True)
        ]

    def gather(self, source: Source, out: Row, which: NDArray[np.intp] | slice = EVERY) -> Row:
        """Fills rows (k, size) with the parts of some of the source's n environments."""
        parts = [part.value(source)[which] for part in self.parts]
        parts = [values if values.ndim == 2 else values.reshape(len(out), -1) for values in parts]
        return np.concatenate(parts, axis=1, out=out)
