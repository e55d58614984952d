"""Trials that measure the interaction with a partner and with what does not give way."""

from typing import Literal, Self

from pydantic import Field, model_validator

from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.evaluation.sequences import STAGNATION, WALKING_ON
from iowbc.recipe.evaluation.suites import Case
from iowbc.recipe.section import Section
from iowbc.recipe.simulation.holding import ObjectScene
from iowbc.recipe.simulation.partner import BEHAVIOURS


class Impedance(Section):
    """Sinusoidal pulls on the centre of mass of a held object, from whose motion the mechanical impedance follows. The
    robot stands meanwhile and nobody else holds the object; it then has to walk on."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, gt=0)
    """Object mass [kg]."""
    directions: tuple[Literal["x", "y"], ...] = Field(default=("x", "y"), min_length=1)
    """Directions of the pull: forward (x) and to the left (y) of the commanded heading."""
    frequencies: tuple[float, ...] = Field(default=(0.2, 0.5, 1.0, 2.0), min_length=1)
    """Frequencies [Hz]: from the slow yielding to a leading partner to the frequency of steps."""
    amplitude: float = Field(default=10.0, gt=0)
    """Amplitude of the force [N]; small against the partner's 80 N, large against the noise of a balancing robot."""
    begin: float = Field(default=2.0, ge=0)
    """Time at which the pull begins [s]."""
    cycles: int = Field(default=3, ge=1)
    """Fewest periods of a pull."""
    shortest: float = Field(default=6.0, gt=0)
    """Shortest pull [s]; it lasts a whole number of periods."""
    walk: tuple[Segment, ...] = Field(default=WALKING_ON, min_length=1)
    """Commands after the pull: a robot that does not move at all fails them."""

    @model_validator(mode="after")
    def _frequencies_are_positive(self) -> Self:
        if min(self.frequencies) <= 0:
            raise ValueError(f"frequencies must be positive, got {list(self.frequencies)}")
        return self


class Compliance(Section):
    """Partners that behave in different ways, a crate that is blocked, and sinusoidal pulls; without impulses and
    pushes, so that every force is that of the interaction."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object that is held."""
    masses: tuple[float, ...] = Field(default=(4.0,), min_length=1)
    """Object masses [kg]."""
    partner_shares: tuple[float, ...] = Field(default=(0.5,), min_length=1)
    """Parts of the weight that the partner bears."""
    behaviours: tuple[str, ...] = BEHAVIOURS
    """How the partner behaves, a case each; the last two are never trained with."""
    trials: int | None = Field(default=None, ge=1, le=10_000)
    """Trials of each case; empty takes `eval.trials`."""
    sequence: tuple[Segment, ...] = ()
    """Commands; empty takes those of the sweeps."""
    blocked: Case | None = Case(
        name="blocked crate", scene="push", mass=65.0, fixed={"resistance_scale": 50.0}, sequence=STAGNATION
    )
    """A push against what does not move; empty leaves it out."""
    impedance: Impedance | None = Impedance()
    """Sinusoidal pulls; empty leaves them out."""

    @model_validator(mode="after")
    def _behaviours_are_known(self) -> Self:
        unknown = [name for name in self.behaviours if name not in BEHAVIOURS]
        if unknown:
            raise ValueError(f"no partner behaviour {unknown[0]!r}; valid: {', '.join(BEHAVIOURS)}")
        if min(self.masses) <= 0:
            raise ValueError(f"masses must be positive, got {list(self.masses)}")
        return self
