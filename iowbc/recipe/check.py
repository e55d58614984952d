"""The small fixed evaluation by which a training keeps its best policy and notices that it got lost."""

from pydantic import Field, NonNegativeFloat, PositiveFloat

from iowbc.recipe.evaluation.segment import DrawnScripts, Segment
from iowbc.recipe.section import COSMETIC, LATER, Section
from iowbc.recipe.simulation.holding import ObjectScene

STAND_WALK_TURN = (
    Segment(duration=1.0, ramp=0.0),
    Segment(duration=3.0, velocity=(0.4, 0.0, 0.0)),
    Segment(duration=2.0, velocity=(0.3, 0.0, 0.3)),
    Segment(duration=2.0, height=0.66, pitch=0.2, ramp=0.8),
    Segment(duration=2.0, ramp=0.5),
)
"""Stand, walk, turn, crouch and lean, stand: 10 s."""


Errors = tuple[PositiveFloat, PositiveFloat, PositiveFloat, PositiveFloat]
IO_WBC_UNLOADED = (0.125, 0.015, 0.046, 0.134)


class Check(Section):
    """A few trials, always the same, played with the policy's mean action every so often."""

    every: int | None = Field(default=50, ge=1)
    """Updates between two checks; a check takes about as long as one update. Empty never checks: the last policy is
    kept, whatever became of it."""
    lifting: tuple[NonNegativeFloat, ...] = (0.0, 4.0, 8.0)
    """Masses in the scene `lift` [kg], where the task plays it; 0 is the scene without an object."""
    pushing: tuple[NonNegativeFloat, ...] = (30.0,)
    """Masses in the scene `push` [kg], where the task plays it."""
    others: dict[ObjectScene, tuple[NonNegativeFloat, ...]] = Field(default_factory=dict, json_schema_extra=LATER)
    """Masses in other scenes [kg], a recipe's own too, where the task plays them."""
    trials: int = Field(default=2, ge=1, le=1000)
    """Trials at each mass."""
    seed: int = Field(default=5000, ge=0, lt=2**32)
    """Seed of the first trial: apart from those of training and export; those of the tables are of another split
    (`eval.split`)."""
    films: int = Field(default=0, ge=0, le=100, json_schema_extra=COSMETIC)
    """Films of a trial of a middling load, one each time a further such part of the training is done; each takes some
    15 s without a graphics card. 0 makes none."""
    sequence: tuple[Segment, ...] = STAND_WALK_TURN
    """Commands of a trial, in order; empty takes `scripts`, or without any the fixed sequences of lifting and of
    pushing."""
    scripts: DrawnScripts | None = Field(default=None, json_schema_extra=LATER)
    """Scripts drawn trial by trial, where `sequence` is empty: a policy is then not chosen by one script."""
    scales: Errors = Field(default=IO_WBC_UNLOADED, json_schema_extra=LATER)
    """Errors E_α [rad], E_h [m], E_v [m/s] and E_ψ [rad] that halve their part of the score; by default the paper's
    IO-WBC without a load (Table II). An error that is far below its scale counts little."""
    fall: float = Field(default=1.0, ge=0, le=1, json_schema_extra=LATER)
    """Factor on the score of a trial that is not survived. At 1 who falls in the last second of twenty
    loses a twentieth, less than what walking a little nearer to the velocity brings."""
    collapse: float = Field(default=1 / 3, gt=0, lt=1)
    """Part of the best score whose loss counts as a collapse: the training goes back to its best policy."""
    notable: float = Field(default=0.4, ge=0, lt=1)
    """Best score from which a fall of it can be a collapse. Below, scores are mostly chance, and fall while a policy
    that stood learns to walk."""
    patience: int = Field(default=3, ge=1)
    """Checks in a row that must say so: one of eight trials more or less moves the score by a tenth."""
    caution: float = Field(default=0.5, gt=0, lt=1)
    """Factor on the desired KL divergence and the learning rate after each collapse."""
    rollbacks: int = Field(default=6, ge=0, le=1000)
    """Collapses without a better policy between them after which the stage gives up."""
