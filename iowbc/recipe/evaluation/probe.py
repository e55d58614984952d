"""What the policy's history knows of the load, asked by a linear probe."""

from typing import Self

from pydantic import Field, model_validator

from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.evaluation.sequences import PROBED
from iowbc.recipe.evaluation.suites import PartnerShare
from iowbc.recipe.section import Section
from iowbc.recipe.simulation.holding import Held, ObjectScene


class Probe(Section):
    """Trials with masses spread over a range, and a linear regression of the mass on what the policy sees in them.

    Every other trial is regressed on, those between them are tested: the masses tested are none that were learnt.
    """

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object."""
    masses: tuple[float, float] = (1.0, 10.0)
    """Lightest and heaviest object [kg]; the trials' masses are spread evenly between them. The default is what
    training carries of the box."""
    trials: int = Field(default=180, ge=20, le=2000)
    """Number of trials, each with a mass and a seed of its own. Some 70 numbers are drawn once for a trial: a
    regression on fewer trials than that cannot tell which of them is the mass."""
    seed: int = Field(default=9000, ge=0, lt=2**32)
    """Seed of the first trial: apart from those of training, its checks, evaluation and export."""
    partner_share: PartnerShare = 0.0
    """As in a sweep. Without a partner, for what the hands feel of a mass is what he leaves."""
    fixed: Held = Field(default_factory=dict)
    """Any other randomised quantity that is held at a value instead of being drawn, by its name."""
    sequence: tuple[Segment, ...] = Field(default=PROBED, min_length=1)
    """Commands of a trial, in order; gentle, so that few end early."""
    interval: float = Field(default=0.5, gt=0)
    """Time between two readings [s]; as long as a history of 25 observations, so that no two share one."""

    @model_validator(mode="after")
    def _masses_ascend(self) -> Self:
        light, heavy = self.masses
        if not 0 < light < heavy:
            raise ValueError(f"masses must be a lightest above 0 and a heavier one, got {list(self.masses)}")
        return self
