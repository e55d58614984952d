"""Planned stages with their expected times, and the options of a run."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from socket import gethostname
from statistics import median
from typing import Any, Literal

from iowbc.pipeline.nested import MISSING, differences, nested
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.store.artifact import Artifact
from iowbc.recipe.recipe import SEEDS

LAST_RUNS = 5
"""Number of runs that an estimate uses; older ones were made by older code or under another load."""
UNSEEN = (0.8, 1.25)
"""Factors by which the next run may lie beyond the fastest and the slowest of them, for other programs change times."""


@dataclass(frozen=True)
class Options:
    """Options of a run, each under its name on the command line, where it takes a value."""

    until: str | None = None
    force: frozenset[str] = frozenset()
    workers: int | None = None
    engine: Literal["local", "ray"] | None = None
    address: str | None = None
    on_code_change: Literal["report", "rerun"] = "report"

    @property
    def same_code(self) -> bool:
        """True if only what the present code made is used."""
        return self.on_code_change == "rerun"


@dataclass(frozen=True)
class StagePlan:
    """A stage of a recipe: its key, whether its artifact can be used, and why not."""

    stage: Stage
    key: str = ""
    """Empty if an input still has to be made."""
    ingredients: Mapping[str, Any] = field(default_factory=dict)
    """Of the key; None for the digest of an input that still has to be made."""
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


def estimated(step: StagePlan, stored: Iterable[Artifact], closest: Artifact) -> StagePlan:
    """A step with its time: the median of its last runs here that differ in seed and counts alone, else a guess at the
    rate of `closest`, the stored artifact that differs least."""
    made = closest.manifest
    rate_of = made.recipe if made.host == gethostname() else f"{made.recipe} on another machine"
    own = sorted((one for one in stored if one.manifest.host == gethostname()), key=lambda one: -one.manifest.made)
    reckoned = (_scaled_time(step, one) for one in own)
    times = [seconds for seconds, alike in reckoned if alike][:LAST_RUNS]
    if not times:
        guess = _scaled_time(step, closest)[0]
        return replace(step, roughly=guess, spread=UNSEEN, rate_of=rate_of)
    middle = median(times)
    spread = (UNSEEN[0] * min(times) / middle, UNSEEN[1] * max(times) / middle) if middle else UNSEEN
    return replace(step, expected=middle, spread=spread, rate_of=rate_of)


def _scaled_time(step: StagePlan, former: Artifact) -> tuple[float, bool]:
    """The time that a stage takes at the rate of a stored artifact [s], which is proportional to each of the stage's
    counts, and whether nothing but seed and counts differs."""
    old, seconds = former.ingredients, former.manifest.seconds
    alike = old.get("version") == step.ingredients["version"]
    for path, before, after in differences(nested(old.get("recipe", {})), nested(step.ingredients["recipe"])):
        if path in step.stage.counts and MISSING not in (before, after) and before:
            seconds *= after / before
        elif path not in SEEDS:
            alike = False
    return seconds, alike
