"""What a sweep varies: values in a grid, and values drawn at random."""

import math
import random
from collections.abc import Mapping, Sequence
from typing import Literal, Self

from pydantic import Field, JsonValue, PositiveFloat, PositiveInt, model_validator

from iowbc.recipe.recipe import NAME
from iowbc.recipe.section import Section

DIGITS = 4
"""Significant digits of a drawn value: it can be read and typed again, and no result hangs on the fifth."""
MOST_VALUES = 10_000
"""Values of one axis at most."""
MOST_POINTS = 1_000
"""Points of a sweep at most, unless more are asked for: planning one takes some 10 ms and 200 kB."""


class Range(Section):
    """Evenly spaced numbers, both ends among them."""

    start: int | float
    """The first value."""
    stop: int | float
    """No value is greater."""
    step: PositiveInt | PositiveFloat = 1
    """Distance of two neighbours."""

    @model_validator(mode="after")
    def _few(self) -> Self:
        if self.stop < self.start:
            raise ValueError(f"stop {self.stop} comes before start {self.start}")
        try:
            few = self._count <= MOST_VALUES
        except (OverflowError, ValueError):  # of infinitely many, and of numbers whose distance is none
            few = False
        if not few:
            raise ValueError(
                f"step {self.step} makes more than {MOST_VALUES:,} values from {self.start} to {self.stop}"
            )
        return self

    @property
    def _count(self) -> int:
        return math.floor((self.stop - self.start) / self.step + 1e-9) + 1

    def values(self) -> list[JsonValue]:
        """The numbers, in order; integers where all three are."""
        found = [self.start + place * self.step for place in range(self._count)]
        return [value if isinstance(value, int) else float(f"{value:.12g}") for value in found]


class Drawn(Section):
    """A number drawn at random: x ~ U(low, high), or log x ~ U(log low, log high)."""

    low: float
    """Lower limit."""
    high: float
    """Upper limit."""
    scale: Literal["linear", "log"] = "linear"
    """`log` draws each order of magnitude alike often: for rates and weights whose size is not known."""
    whole: bool = False
    """Whether it is rounded to an integer."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.high <= self.low:
            raise ValueError(f"high {self.high} is not greater than low {self.low}")
        if not math.isfinite(self.high - self.low):
            raise ValueError(f"{self.low} to {self.high} is too wide to draw from")
        if self.scale == "log" and self.low <= 0:
            raise ValueError(f"low {self.low}: a logarithmic scale begins above 0")
        return self

    def value(self, part: float) -> int | float:
        """The number for a part of the way from low to high, 0 to 1."""
        if self.scale == "log":
            found = math.exp(math.log(self.low) + part * (math.log(self.high) - math.log(self.low)))
        else:
            found = self.low + part * (self.high - self.low)
        return round(found) if self.whole else float(f"{found:.{DIGITS}g}")


class Draws(Section):
    """Points drawn at random, each with all of these values."""

    count: int = Field(ge=1, le=MOST_VALUES)
    """Number of draws."""
    seed: int = Field(default=0, ge=0, lt=2**32)
    """Seed of the draws: more of them leave the first ones as they were, and so do more paths."""
    values: Mapping[str, Drawn] = Field(min_length=1)
    """What is drawn, by dotted path of the recipe."""

    def points(self) -> list[dict[str, JsonValue]]:
        """The drawn values of each draw, by dotted path."""
        sources = {path: random.Random(f"{self.seed} {path}") for path in self.values}
        return [
            {path: drawn.value(sources[path].random()) for path, drawn in self.values.items()}
            for _ in range(self.count)
        ]


class SweepFile(Section):
    """The file of a sweep, `iowbc sweep RECIPE --from FILE`: every combination of the grid with every draw."""

    name: str | None = Field(default=None, pattern=f"^{NAME}$", max_length=64)
    """Name of the sweep; the file's name when empty."""
    description: str = ""
    """What the sweep is for, in a sentence."""
    grid: Mapping[str, Sequence[JsonValue] | Range] = {}
    """Values by dotted path of the recipe: a list, or a range with `start`, `stop` and `step`; an item `0..4` of a list
    stands for the integers 0 to 4."""
    draws: Draws | None = None
    """Values that are drawn at random."""
