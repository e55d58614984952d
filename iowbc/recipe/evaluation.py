"""Trials of the trained policy: which scenes, masses and commands, how often, and what counts as success."""

from typing import Literal, Self

from pydantic import Field, field_validator, model_validator

from iowbc.recipe.section import COSMETIC, Section
from iowbc.recipe.simulation.holding import Held, ObjectScene

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


class Beyond(Section):
    """How a sweep goes on past its last mass, until nothing survives."""

    step: float = Field(default=2.0, gt=0)
    """Mass added at a time [kg]."""
    limit: float = Field(default=30.0, gt=0)
    """No mass above this is tried [kg]."""


class Sweep(Section):
    """Trials over a range of object masses in one scene."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes` in which the object is met; a mass of 0 is played in the scene without an object."""
    masses: tuple[float, ...] = Field(default=(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0), min_length=1)
    """Object masses [kg], ascending."""
    beyond: Beyond | None = None
    """Heavier masses, tried as long as one trial survives; empty stops at the last mass."""
    rolling_resistance: float | None = Field(default=None, ge=0, le=1)
    """Rolling resistance μ of the crate's wheels; empty draws it as in training."""
    partner_share: float | None = Field(default=0.0, ge=-1, le=1)
    """Part of the weight, or in pushing of the rolling resistance, that the partner bears; negative resists, 0 leaves
    all of it to the robot, empty draws it as in training."""
    fixed: Held = Field(default_factory=dict)
    """Any other randomised quantity that is held at a value instead of being drawn, by its name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this sweep; empty takes `eval.sequence`."""

    @model_validator(mode="after")
    def _masses_ascend(self) -> Self:
        if any(mass < 0 for mass in self.masses):
            raise ValueError(f"masses must not be negative, got {list(self.masses)}")
        if list(self.masses) != sorted(set(self.masses)):
            raise ValueError(f"masses must ascend without repetition, got {list(self.masses)}")
        return self


class HeavyCase(Section):
    """One of the paper's heavy tasks, reported by its success rate."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.-]*$")
    """Name of the case in tables and figures."""
    scene: ObjectScene
    """Scene of `simulation.scenes`."""
    mass: float = Field(gt=0)
    """Object mass [kg]."""
    rolling_resistance: float | None = Field(default=None, ge=0, le=1)
    """Rolling resistance μ of the crate's wheels; empty draws it as in training."""
    partner_share: float | None = Field(default=0.5, ge=-1, le=1)
    """As in a sweep; half of the load by default, for these are carried by two."""
    fixed: Held = Field(default_factory=dict)
    """Any other randomised quantity that is held at a value instead of being drawn, by its name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this case; empty takes `eval.sequence`."""


class Success(Section):
    """When a trial counts as survived: no fall and nothing dropped, by `task.termination`, for the whole trial."""

    slip_fails: bool = False
    """Also count a trial as failed in which a hand ever lost the object, even though the other kept it."""
    capacity_rate: float = Field(default=0.8, gt=0, le=1, json_schema_extra=COSMETIC)
    """Success rate that a mass, and every lighter one, must reach to count as carried (load capacity)."""


class Video(Section):
    """Short films of trials."""

    count: int = Field(default=2, ge=0)
    """Number of films, spread over the sweeps' masses; 0 makes none."""
    width: int = Field(default=640, ge=64, le=3840, multiple_of=16)
    """Width of a frame [pixel]; video codecs want multiples of 16."""
    height: int = Field(default=480, ge=64, le=2160, multiple_of=16)
    """Height of a frame [pixel]."""
    fps: int = Field(default=20, ge=1, le=50)
    """Frames per second; a frame takes 0.1 to 0.2 s to draw without a graphics card."""
    duration: float = Field(default=12.0, gt=0)
    """Longest film [s]."""
    traces: bool = True
    """Draw scene, mass, time and command into the frames."""


STAND_WALK_TURN = (
    Segment(duration=2.0, ramp=0.0),
    Segment(duration=4.0, velocity=(0.4, 0.0, 0.0)),
    Segment(duration=3.0, velocity=(0.3, 0.0, 0.3)),
    Segment(duration=2.0),
    Segment(duration=3.0, height=0.65, ramp=1.0),
    Segment(duration=3.0, height=0.70, pitch=0.3, ramp=1.0),
    Segment(duration=3.0, ramp=1.0),
)
"""Stand, walk, turn, stop, lower the pelvis, lean forward, and back: 20 s."""


class Evaluation(Section):
    """Trials of the trained policy."""

    policy: Literal["student", "teacher"] = "student"
    """Which network acts: the deployable student, or the teacher with its privileged observation."""
    label: str = Field(default="IO-WBC", min_length=1, json_schema_extra=COSMETIC)
    """Name of the variant in tables and figures; the paper's are IO-WBC, WBC, w/o RG, w/o Distill."""
    trials: int = Field(default=5, ge=1)
    """Trials per mass; trial k of every mass and variant has the same seed."""
    seed: int = Field(default=1000, ge=0)
    """Seed of the first trial; apart from the seed of training, so that no trial was met there."""
    sequence: tuple[Segment, ...] = STAND_WALK_TURN
    """Commands of a trial, in order; their durations add up to the trial's."""
    lifting: Sweep | None = Sweep()
    """Masses lifted (paper's Table II); empty leaves the sweep out."""
    pushing: Sweep | None = None
    """Masses pushed (paper's Table III), with a rolling resistance; empty leaves the sweep out."""
    heavy: tuple[HeavyCase, ...] = ()
    """The paper's heavy tasks: 7 kg box, 18 kg tyre, 65 kg crate with a partner."""
    disturbances: bool = False
    """Keep the impulses on the object and the pushes on the base during trials."""
    success: Success = Success()
    """When a trial counts as survived."""
    video: Video = Field(default=Video(), json_schema_extra=COSMETIC)
    """Short films of trials."""

    @model_validator(mode="after")
    def _commands_something(self) -> Self:
        if not self.sequence:
            raise ValueError("sequence: is empty; give at least one segment, or leave the key out")
        return self

    @model_validator(mode="after")
    def _cases_told_apart(self) -> Self:
        names = [case.name for case in self.heavy]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ValueError(f"heavy: {', '.join(repeated)} is the name of more than one case; give each its own")
        return self

    @model_validator(mode="after")
    def _something_to_do(self) -> Self:
        if self.lifting is None and self.pushing is None and not self.heavy:
            raise ValueError("nothing to evaluate: give lifting, pushing or heavy, or leave eval out of the stages")
        return self
