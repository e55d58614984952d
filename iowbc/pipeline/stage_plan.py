"""Planned stages, and the options of a run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from iowbc.pipeline.stage import Stage
from iowbc.pipeline.store.artifact import Artifact


@dataclass(frozen=True)
class Options:
    """Options of a run, each under its name on the command line, where it takes a value."""

    until: str | None = None
    force: frozenset[str] = frozenset()
    workers: int | None = None
    engine: Literal["local", "ray"] | None = None
    address: str | None = None
    on_code_change: Literal["report", "rerun"] = "report"


@dataclass(frozen=True)
class StagePlan:
    """A stage of a recipe: its key, whether its artifact can be used, and why not."""

    stage: Stage
    key: str = ""
    """Empty if an input still has to be made."""
    ingredients: Mapping[str, Any] = field(default_factory=dict)
    inputs: Mapping[str, Artifact] = field(default_factory=dict)
    """Input artifacts that exist."""
    artifact: Artifact | None = None
    """The stored artifact with this key, whole; also where it would be replaced."""
    reasons: tuple[str, ...] = ()
    """Why it would run; empty where it is cached."""
    notes: tuple[str, ...] = ()
    damage: str = ""
    """The damage of the stored artifact with this key."""
    expected: float | None = None
    """Time that it takes by its last runs on this machine or by its last attempt [s]; None where there are none."""
    spread: tuple[float, float] = (1.0, 1.0)
    """Range of the expected time, as factors of it."""
    roughly: float | None = None
    """A guess at the rate of the most similar stored artifact, if there are no such runs [s]."""
    rate_of: str = ""
    """Source of that rate: a recipe, and "on another machine" if so."""
    code: Mapping[str, str] = field(default_factory=dict)
    predecessor: Artifact | None = None
    """The stored artifact that it would go on from."""
    shared_with: str = ""
    """Of one recipe among several: the earlier one that makes it; empty where this one does, or where it is cached."""

    @property
    def cached(self) -> bool:
        """True if the stage does not have to run."""
        return not self.reasons

    @property
    def published(self) -> bool:
        """True where that came with the repository."""
        return self.cached and self.artifact is not None and self.artifact.published

    @property
    def guess(self) -> float | None:
        """The expected time, else the guess [s]."""
        return self.roughly if self.expected is None else self.expected
