"""Scenes, and quantities of an episode that a trial may hold at a value, by name: checked when a recipe is read."""

from typing import Annotated

from pydantic import AfterValidator, Field

from iowbc.recipe.distribution import Distribution
from iowbc.recipe.partner import Partner
from iowbc.recipe.randomization import Randomization
from iowbc.recipe.scene import Scenes

SCENES = tuple(Scenes.model_fields)
"""Names of the scenes."""
SWITCHES = ("impulse_scale", "push_scale", "noise_scale", "load_scale")
"""Factors on impulses, pushes, sensor noise, and on how far the object's mass may rise in its range."""
HOLDABLE = (
    *(name for name, field in Randomization.model_fields.items() if field.annotation is Distribution),
    *(
        f"partner_{name}"
        for name, field in Partner.model_fields.items()
        if field.annotation is Distribution and name != "push_share"  # in a push it is drawn as the partner's share
    ),
    *SWITCHES,
    "object_mass",
)
"""Names of what is drawn for an episode."""


def _known_scene(name: str) -> str:
    if name not in SCENES:
        raise ValueError(f"no scene {name!r}; valid: {', '.join(SCENES)}")
    return name


def _known_quantities(held: dict[str, float]) -> dict[str, float]:
    unknown = sorted(set(held) - set(HOLDABLE))
    if unknown:
        raise ValueError(f"no randomised quantity {', '.join(unknown)}; valid: {', '.join(sorted(HOLDABLE))}")
    return held


SceneName = Annotated[str, AfterValidator(_known_scene), Field(json_schema_extra={"enum": list(SCENES)})]
Held = Annotated[dict[str, float], AfterValidator(_known_quantities)]
