"""Names of scenes, and of random quantities that a trial may fix; both are validated when a recipe is read."""

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

from iowbc.recipe.section import Problems, Section, marked_fields
from iowbc.recipe.simulation.partner import BEHAVIOURS, OWN_DRAWS, PartnerSettings
from iowbc.recipe.simulation.randomization import LATENCIES, POSITIVE, SIGNED, Distribution, Randomization
from iowbc.recipe.simulation.scene import Scenes
from iowbc.recipe.simulation.simulation import SimulationSettings

SCENES = tuple(Scenes.model_fields)
"""Names of the built-in scenes."""
FREE = "free"
"""The scene without an object."""
SWITCHES = ("impulse_scale", "push_scale", "noise_scale", "load_scale", "resistance_scale")
"""Factors on impulses, pushes, sensor noise, the width of the object's mass range above its lower end, and a crate's
rolling resistance (a factor of fifty blocks it). 1 unless fixed at another value; 0 disables the quantity."""
BY_AXIS = tuple(f"object_com_offset_{axis}" for axis in "xyz")
"""Components of the offset of the object's centre of mass, in the object's frame."""


def _drawn(section: type[Section]) -> Iterator[str]:
    """Names of the randomized fields of a section."""
    return (name for name, field in section.model_fields.items() if field.annotation is Distribution)


HOLDABLE = (
    *(name for name in _drawn(Randomization) if name != "object_mass_scale"),
    *(f"partner_{name}" for name in _drawn(PartnerSettings) if not name.endswith("share")),
    *(f"{section}_{name}" for section, kind in OWN_DRAWS.items() for name in _drawn(kind)),
    *SWITCHES,
    *BY_AXIS,
    "partner_behaviour",
)
"""Names of all quantities that a trial may fix. Mass and the partner's share have fields of their own."""
OF_EITHER_SIGN = (
    *(*SIGNED, *BY_AXIS, "partner_pace", "leader_pace", "leader_turning", "leader_sideways", "leader_rise"),
    *("stopping_reverse",),
)


def _with_object(name: str) -> str:
    if name == FREE:
        raise ValueError(f"the scene {FREE} has no object; name another: a mass of 0 is without one")
    return name


def _known_quantities(held: dict[str, float]) -> dict[str, float]:
    unknown = sorted(set(held) - set(HOLDABLE))
    if unknown:
        own = "mass and partner_share are fields of their own"
        raise ValueError(f"no randomised quantity {', '.join(unknown)}; valid: {', '.join(sorted(HOLDABLE))}; {own}")
    for name, value in held.items():
        if name == "partner_behaviour" and value not in range(len(BEHAVIOURS)):
            raise ValueError(f"{name}: {value:g} is no behaviour; valid: {', '.join(BEHAVIOURS)}")
        if (value < 0.0 and name not in OF_EITHER_SIGN) or (value == 0.0 and name in POSITIVE):
            raise ValueError(f"{name}: {value:g} should be {'positive' if name in POSITIVE else '0 or more'}")
    return held


def _behaviour_by_name(held: Any) -> Any:
    """Replace a behaviour's name, as in `partner_behaviour: leader`, by its index in `BEHAVIOURS`."""
    if not (isinstance(held, dict) and isinstance(name := held.get("partner_behaviour"), str)):
        return held
    if name not in BEHAVIOURS:
        raise ValueError(f"no partner behaviour {name!r}; valid: {', '.join(BEHAVIOURS)}")
    return held | {"partner_behaviour": float(BEHAVIOURS.index(name))}


WITH_OBJECT = AfterValidator(_with_object)
"""Marks the fields that name a scene with an object."""
ObjectScene = Annotated[
    str, WITH_OBJECT, Field(json_schema_extra={"examples": [name for name in SCENES if name != FREE]})
]
"""Name of a scene with an object; the recipe may define further ones."""
HELD = AfterValidator(_known_quantities)
"""Marks the fields that fix random quantities."""
Held = Annotated[dict[str, float], HELD, BeforeValidator(_behaviour_by_name)]


def held_delay_problems(section: Section, path: str, simulation: SimulationSettings) -> Problems:
    """Delays below a section that are fixed beyond the delay lines of the simulation."""
    buffered = simulation.randomization.longest_latency, "simulation.randomization.longest_latency"
    felt = simulation.partner.longest_delay, "the longest of simulation.partner.delay and .lagging.delay"
    limits: dict[str, tuple[float, str]] = dict.fromkeys(LATENCIES, buffered) | {"partner_delay": felt}
    for place, held in marked_fields(section, path, HELD):
        for name, (limit, source) in limits.items():
            if name in held and held[name] > limit:
                yield place, f"{name}: {held[name]:g} is above {limit:g}, {source}"
