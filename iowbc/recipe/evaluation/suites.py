"""Groups of trials: sweeps over mass, single cases, and pushes on the base that grow until the robot falls."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.evaluation.sequences import STAGNATION, STANDING
from iowbc.recipe.section import Section
from iowbc.recipe.simulation.holding import Held, ObjectScene

PartnerShare = Annotated[float, Field(ge=-1, le=1)] | None


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
    partner_shares: tuple[PartnerShare, ...] = Field(default=(0.0, 0.5), min_length=1)
    """The sweep is made once with each: part of the weight, or in pushing of the rolling resistance, that the partner
    bears; negative resists, 0 leaves all of it to the robot, empty draws it as in training."""
    fixed: Held = Field(default_factory=dict)
    """Any other randomised quantity that is held at a value instead of being drawn, by its name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this sweep; empty takes `eval.sequence`, or else that of lifting or pushing."""

    @model_validator(mode="after")
    def _masses_ascend(self) -> Self:
        if any(mass < 0 for mass in self.masses):
            raise ValueError(f"masses must not be negative, got {list(self.masses)}")
        if list(self.masses) != sorted(set(self.masses)):
            raise ValueError(f"masses must ascend without repetition, got {list(self.masses)}")
        if len(set(self.partner_shares)) != len(self.partner_shares):
            raise ValueError(f"partner_shares must differ, got {list(self.partner_shares)}")
        return self


class Case(Section):
    """Trials of one object under one condition."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.%-]*$")
    """Name of the case in tables and figures."""
    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, ge=0)
    """Object mass [kg]; a mass of 0 is played in the scene without an object."""
    rolling_resistance: float | None = Field(default=None, ge=0)
    """Rolling resistance μ of the crate's wheels; empty draws it as in training."""
    partner_share: PartnerShare = 0.0
    """As in a sweep."""
    fixed: Held = Field(default_factory=dict)
    """Any other randomised quantity that is held at a value instead of being drawn, by its name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this case; empty takes `eval.sequence`, or else that of lifting or pushing."""
    repetitions: int = Field(default=1, ge=1)
    """How often the sequence is played in a row."""


class HeavyCase(Case):
    """One of the paper's heavy tasks, reported by its success rate."""

    partner_share: PartnerShare = 0.5
    """As in a sweep; half of the load by default, for these are carried by two."""


class Stagnation(Section):
    """Pushes that cannot succeed (paper IV-D). Success is to stay upright in posture; E_v is expected to be large."""

    cases: tuple[Case, ...] = Field(
        default=(
            Case(name="crate above friction", scene="push", mass=65.0, rolling_resistance=1.0, sequence=STAGNATION),
            Case(name="blocked crate", scene="push", mass=65.0, fixed={"resistance_scale": 50.0}, sequence=STAGNATION),
        ),
        min_length=1,
    )
    """At μ 1.0 the 65 kg crate resists with 638 N, and foot friction of at most 1.2 allows 392 N; with fifty times its
    resistance it does not move at all."""


class PushLadder(Section):
    """Pushes on the base that grow until the robot falls: the impulse survived in each direction."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, ge=0)
    """Object mass [kg]."""
    directions: tuple[Literal["forward", "backward", "left", "right"], ...] = ("forward", "backward", "left", "right")
    """Horizontal directions in the frame of the robot's heading."""
    impulses: tuple[float, ...] = Field(default=(10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0), min_length=1)
    """Sizes tried [N·s], ascending; 37 N·s would give robot and 4 kg box 1 m/s in the air."""
    time: float = Field(default=2.0, ge=0)
    """When the push begins [s]."""
    duration: float = Field(default=0.1, gt=0)
    """Time over which it acts, as a constant force [s]."""
    sequence: tuple[Segment, ...] = Field(default=STANDING, min_length=1)
    """Commands while it is pushed."""

    @model_validator(mode="after")
    def _impulses_ascend(self) -> Self:
        if list(self.impulses) != sorted(set(self.impulses)) or self.impulses[0] <= 0:
            raise ValueError(f"impulses must be positive and ascend without repetition, got {list(self.impulses)}")
        return self


class Robustness(Section):
    """What the paper does not try: conditions outside of the training's, long trials, pushes until the robot falls."""

    cases: tuple[Case, ...] = (
        Case(name="nominal"),
        Case(name="encoder bias", fixed={"encoder_bias": 0.03}),
        Case(name="inertial bias", fixed={"imu_tilt": 0.06, "gyro_bias": 0.04}),
        Case(name="gains 80 %", fixed={"kp_scale": 0.8, "kd_scale": 0.8}),
        Case(name="gains 120 %", fixed={"kp_scale": 1.2, "kd_scale": 1.2}),
        Case(name="weak motors", fixed={"motor_strength": 0.7}),
        Case(name="friction 0.4", fixed={"ground_friction": 0.4}),
        Case(name="held by friction", scene="squeeze"),
        Case(name="60 s", repetitions=3),
    )
    """Conditions with a 4 kg box: twice the training's largest bias of encoders [rad], inertial unit [rad], gyroscope
    [rad/s], twice its change of gains and loss of strength, less than its least friction, palms that hold the box by
    nothing but friction, three sequences in a row."""
    pushes: PushLadder | None = PushLadder()
    """Pushes on the base; empty leaves them out."""
