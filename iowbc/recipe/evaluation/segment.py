"""A stretch of a scripted command sequence."""

from typing import Self

from pydantic import Field, field_validator, model_validator

from iowbc.recipe.section import Section

REACHABLE_HEIGHT = (0.3, 1.0)
"""No humanoid of this size commands its pelvis out of these heights [m]."""
REACHABLE_OFFSET = 0.5
"""No arm of this size takes its wrist farther from the grasp, along an axis [m]."""


class Segment(Section):
    """A stretch of a command sequence; the command moves to these values over `ramp` and then holds."""

    duration: float = Field(gt=0, le=600)
    """How long the segment lasts, its ramp included [s]."""
    ramp: float = Field(default=0.5, ge=0)
    """Time over which the command moves linearly from the previous segment's values [s]."""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Commanded v_x, v_y [m/s] and yaw rate [rad/s] in the heading frame."""
    height: float | None = None
    """Commanded pelvis height [m], 0.3 to 1.0; empty takes the task's default height."""
    pitch: float = Field(default=0.0, ge=-1.6, le=1.6)
    """Commanded torso pitch [rad], positive leans forward."""
    wrists: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Wrist offsets Δp, left then right, heading frame [m], each within 0.5."""

    @field_validator("height")
    @classmethod
    def _height_within_reach(cls, height: float | None) -> float | None:
        low, high = REACHABLE_HEIGHT
        if height is not None and not low <= height <= high:
            raise ValueError(f"the pelvis never reaches a height of {height:g} m; give {low:g} to {high:g} m")
        return height

    @field_validator("wrists")
    @classmethod
    def _wrists_within_reach(cls, wrists: tuple[float, ...]) -> tuple[float, ...]:
        beyond = [offset for offset in wrists if abs(offset) > REACHABLE_OFFSET]
        if beyond:
            raise ValueError(
                f"the wrists never reach an offset of {beyond[0]:g} m from their grasp; "
                f"give -{REACHABLE_OFFSET:g} to {REACHABLE_OFFSET:g} m"
            )
        return wrists

    @model_validator(mode="after")
    def _ramp_fits(self) -> Self:
        if self.ramp > self.duration:
            raise ValueError(f"ramp {self.ramp} s is longer than the segment's duration {self.duration} s")
        return self
