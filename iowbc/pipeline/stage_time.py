"""The expected time of a planned stage, by its last runs or by the rate of the most similar one."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from socket import gethostname
from statistics import median
from typing import Any

from iowbc.pipeline.nested import MISSING, differences, nested
from iowbc.pipeline.stage import Stage
from iowbc.pipeline.stage_plan import StagePlan
from iowbc.pipeline.store.artifact import Artifact
from iowbc.recipe.recipe import SEEDS

LAST_RUNS = 5
"""Number of runs that an estimate uses; older ones were made by older code or under another load."""
UNSEEN = (0.8, 1.25)
"""Factors by which the next run may lie beyond the fastest and the slowest of them, for other programs change times."""


def estimated(
    step: StagePlan, ingredients: Mapping[str, Any], stored: Iterable[Artifact], closest: Artifact
) -> StagePlan:
    """A step with its time: the median of its last runs here that differ in seed and counts alone, else a guess at the
    rate of `closest`, the stored artifact that differs least."""
    made = closest.manifest
    rate_of = made.recipe if made.host == gethostname() else f"{made.recipe} on another machine"
    own = sorted((one for one in stored if one.manifest.host == gethostname()), key=lambda one: -one.manifest.made)
    reckoned = (_scaled_time(step.stage, one, ingredients) for one in own)
    times = [seconds for seconds, alike in reckoned if alike][:LAST_RUNS]
    if not times:
        guess = _scaled_time(step.stage, closest, ingredients)[0]
        return replace(step, roughly=guess, spread=UNSEEN, rate_of=rate_of)
    middle = median(times)
    spread = (UNSEEN[0] * min(times) / middle, UNSEEN[1] * max(times) / middle) if middle else UNSEEN
    return replace(step, expected=middle, spread=spread, rate_of=rate_of)


def _scaled_time(stage: Stage, former: Artifact, ingredients: Mapping[str, Any]) -> tuple[float, bool]:
    """The time that a stage takes at the rate of a stored artifact [s], which is proportional to each of the stage's
    counts, and whether nothing but seed and counts differs."""
    old, seconds = former.ingredients, former.manifest.seconds
    alike = old.get("version") == ingredients["version"]
    for path, before, after in differences(nested(old.get("recipe", {})), nested(ingredients["recipe"])):
        if path in stage.counts and MISSING not in (before, after) and before:
            seconds *= after / before
        elif path not in SEEDS:
            alike = False
    return seconds, alike
