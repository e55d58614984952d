"""The three phases of training."""

from typing import Self

from pydantic import Field, model_validator

from iowbc.recipe.section import Section


class Phase(Section):
    """How hard the world is at the end of a phase; between two phases the values are interpolated."""

    velocity: float = Field(ge=0.0)
    """Factor on the range of velocity and yaw rate commands; 0 stands still, above 1 goes beyond the recipe's range."""
    posture: float = Field(ge=0.0, le=1.0)
    """Part of the range of height, pitch and wrist offsets that is used, around the nominal posture."""
    load: float = Field(ge=0.0)
    """Upper end of the load range, as a part of the scene's own; the lower end stays."""
    disturbance: float = Field(ge=0.0)
    """Factor on impulses and pushes."""


class Curriculum(Section):
    """Static balance under varied loads, then locomotion with impulses, then partly infeasible commands.

    Each environment has its own level in [0, 3]: 0 is the start of phase 1, 1 its end. It rises after an episode that
    survived *and* tracked, and falls after one that ended early.
    """

    enabled: bool = True
    """Off trains every environment at `fixed_level`."""
    fixed_level: float = Field(default=2.0, ge=0.0, le=3.0)
    """Level without a curriculum; also that of evaluation and of single environments. 2 is the recipe's own ranges."""
    start: Phase = Phase(velocity=0.0, posture=0.2, load=0.5, disturbance=0.0)
    """Level 0."""
    balance: Phase = Phase(velocity=0.0, posture=1.0, load=1.0, disturbance=0.3)
    """Level 1, the end of phase 1: static balance under varied loads."""
    locomotion: Phase = Phase(velocity=1.0, posture=1.0, load=1.0, disturbance=1.0)
    """Level 2, the end of phase 2: locomotion with impulses."""
    extreme: Phase = Phase(velocity=1.6, posture=1.0, load=1.3, disturbance=1.5)
    """Level 3, the end of phase 3: commands and loads that are partly infeasible."""
    rise: float = Field(default=0.05, ge=0.0)
    """Added to the level after a success."""
    fall: float = Field(default=0.1, ge=0.0)
    """Taken from the level after an episode that ended before `early` of its time. More than `rise`: the level comes to
    rest where two of three episodes succeed. With half of `rise` it ran ahead until nearly all episodes ended in a
    fall, and walking was never practised."""
    early: float = Field(default=0.7, gt=0.0, le=1.0)
    """Part of the time limit before which an end counts as a failure."""
    tracking: float = Field(default=0.65, ge=0.0, le=1.0)
    """Tracking that a success needs: velocity, yaw rate, height and pitch are scored between 0 and 1 by their terms of
    the reward, averaged over the episode, and the worst counts. The mean of the four would let a robot pass that stands
    where it should walk at 0.3 m/s: it scores 0.24 for velocity and 0.7 on the whole."""
    limit: float = Field(default=3.0, ge=0.0, le=3.0)
    """Highest level."""

    @model_validator(mode="after")
    def _level_within_limit(self) -> Self:
        if self.fixed_level > self.limit:
            raise ValueError(f"fixed_level: {self.fixed_level} is above the limit of {self.limit}")
        return self
