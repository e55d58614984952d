"""Suites of trials: mass sweeps, single cases, pushes, a probe of the history, and interaction with partners."""

from typing import Annotated, Literal, get_args

from pydantic import AfterValidator, Field, PositiveFloat

from iowbc.recipe.evaluation.sequences import BOWING, PROBED, STAGNATION, STANDING, WALKING, WALKING_ON, Segment
from iowbc.recipe.section import Ascending, Distinct, Masses, Problems, Section, ascending
from iowbc.recipe.simulation.holding import Held, ObjectScene
from iowbc.recipe.simulation.partner import BEHAVIOURS, Behaviour

SignedShare = Annotated[float, Field(ge=-1, le=1)]
PartnerShare = SignedShare | None


class SweepExtension(Section):
    """Continuation of a sweep past its last mass, until no trial succeeds."""

    step: float = Field(default=2.0, gt=0)
    """Mass increment [kg]."""
    limit: float = Field(default=30.0, gt=0)
    """Largest mass [kg]."""


class ShareOverride(Section):
    """Overrides of a sweep's settings for one partner share."""

    partner_share: float = Field(ge=-1, le=1)
    """The share, one of the sweep's `partner_shares`."""
    masses: Masses | None = Field(default=None, min_length=1)
    """Object masses [kg], ascending; empty: the sweep's."""
    rolling_resistance: float | None = Field(default=None, ge=0, le=1)
    """Rolling resistance μ; empty: the sweep's."""


class MassSweep(Section):
    """Trials over a range of object masses in one scene."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes` or `eval.scenes` with the object."""
    masses: Masses = Field(default=(0.05, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0), min_length=1)
    """Object masses [kg], ascending; none is lighter than the object's `smallest_mass`."""
    no_object: bool = True
    """Also run the commands once without object and partner: the row "no object"."""
    undisturbed: Masses = ()
    """Masses of an additional suite without impulses and pushes if `eval.disturbances` is on [kg]; empty: none."""
    beyond: SweepExtension | None = None
    """Heavier masses, for as long as one trial succeeds; empty: stop at the last mass."""
    rolling_resistance: float | None = Field(default=None, ge=0, le=1)
    """Rolling resistance μ of the crate's wheels; empty: drawn as in training."""
    partner_shares: Annotated[tuple[PartnerShare, ...], Distinct] = Field(default=(0.0, 0.5), min_length=1)
    """Nominal fractions of the weight (in pushing, of the rolling resistance) that the partner bears, besides the
    spring and damper of its hands; the sweep runs once for each. Negative: the partner resists; 0: the robot bears all;
    empty: drawn as in training."""
    with_share: tuple[ShareOverride, ...] = ()
    """Other masses, or another rolling resistance, for some of these shares."""
    fixed: Held = Field(default_factory=dict)
    """Fixed values of other randomized quantities, by name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this sweep; empty: `eval.sequence`, else `eval.scripts`, else that of lifting or pushing."""

    def at(self, share: float | None) -> "MassSweep":
        """The sweep for one partner share, with the overrides of `with_share` applied."""
        own = [one for one in self.with_share if one.partner_share == share]
        given = {name: value for one in own for name, value in one if value is not None and name != "partner_share"}
        return self.model_copy(update={**given, "partner_shares": (share,), "with_share": ()})

    def problems(self) -> Problems:
        named = [one.partner_share for one in self.with_share]
        if len(set(named)) != len(named) or not set(named) <= set(self.partner_shares):
            yield "", f"with_share must name each of partner_shares once at most, got {named}"


class Case(Section):
    """Trials of one object under one condition."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 _.,+%-]*$")
    """Name of the case in tables and figures."""
    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, ge=0)
    """Object mass [kg]; 0: no object."""
    rolling_resistance: float | None = Field(default=None, ge=0)
    """Rolling resistance μ of the crate's wheels; empty: drawn as in training."""
    partner_share: PartnerShare = 0.0
    """Fraction of the weight or rolling resistance that the partner bears, as in a sweep."""
    fixed: Held = Field(default_factory=dict)
    """Fixed values of other randomized quantities, by name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this case; empty: `eval.sequence`, else `eval.scripts`, else that of lifting or pushing."""
    repetitions: int = Field(default=1, ge=1)
    """Repetitions of the sequence within a trial; drawn scripts differ between repetitions."""


class HeavyCase(Case):
    """One of the paper's heavy tasks, reported by its success rate."""

    partner_share: PartnerShare = 0.5
    """Fraction of the load that the partner bears, as in a sweep; half by default, since two carry these objects."""


BLOCKED = Case(name="blocked crate", scene="push", mass=65.0, fixed={"resistance_scale": 50.0}, sequence=STAGNATION)
"""Push against a crate that does not move."""


class Stagnation(Section):
    """Infeasible pushes (paper IV-D). Success: continued pushing in the commanded posture, on feet that do not slide;
    E_v is expected to be large."""

    cases: tuple[Case, ...] = Field(
        default=(BLOCKED.model_copy(update={"fixed": BLOCKED.fixed | {"ground_friction": 0.5}}),), min_length=1
    )
    """Cases of the suite. By default, a 65 kg crate with fifty times its rolling resistance resists with 638 N or more,
    whereas foot friction of 0.5, the smallest of training, allows 164 N. With higher friction, a robot in the commanded
    posture tips over before it pushes with half of what friction allows."""


Direction = Literal[
    "forward", "forward left", "left", "backward left", "backward", "backward right", "right", "forward right"
]
EIGHT: tuple[Direction, ...] = get_args(Direction)


class PushLadder(Section):
    """Pushes on the base with increasing impulse until the robot falls. They measure the impulse survived in each
    direction; the robot must walk afterwards."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, ge=0)
    """Object mass [kg]."""
    directions: Annotated[tuple[Direction, ...], Distinct] = EIGHT
    """Horizontal directions in the frame of the robot's heading."""
    trials: int | None = Field(default=5, ge=1, le=10_000)
    """Trials per impulse and direction; empty: `eval.trials`. Few suffice: neighbouring results support each other."""
    impulses: Ascending = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
    """Impulses [N·s], ascending; 37 N·s would accelerate a free robot with a 4 kg box to 1 m/s."""
    time: float = Field(default=2.0, ge=0)
    """Start of the push [s]."""
    duration: float = Field(default=0.1, gt=0)
    """Duration of the push, a constant force [s]."""
    sequence: tuple[Segment, ...] = Field(default=STANDING, min_length=1)
    """Commands during the trial."""

    def problems(self) -> Problems:
        end = sum(segment.duration for segment in self.sequence)
        if self.time + self.duration > end:
            yield "", f"time: a push from {self.time:g} to {self.time + self.duration:g} s is not within the {end:g} s"


class Robustness(Section):
    """Trials beyond the paper's: conditions outside those of training, long trials, pushes until the robot falls."""

    cases: tuple[Case, ...] = (
        Case(name="nominal"),
        Case(name="encoder bias", fixed={"encoder_bias": 0.03}),
        Case(name="inertial bias", fixed={"imu_tilt": 0.06, "gyro_bias": 0.04}),
        Case(name="gains 80 %", fixed={"kp_scale": 0.8, "kd_scale": 0.8}),
        Case(name="gains 120 %", fixed={"kp_scale": 1.2, "kd_scale": 1.2}),
        Case(name="weak motors", fixed={"motor_strength": 0.7}),
        Case(name="weak motors and linkages", fixed={"motor_strength": 0.7, "linkage_effort": 35.0}),
        Case(name="latency 30 + 30 ms", fixed={"action_latency": 1.5, "sensor_latency": 1.5}),
        Case(name="friction 0.4", fixed={"ground_friction": 0.4}),
        Case(name="crate, rolling resistance 0.02", scene="push", mass=30.0, rolling_resistance=0.02),
        Case(name="crate, rolling resistance 0.15", scene="push", mass=30.0, rolling_resistance=0.15),
        Case(name="box 0.2 m wide", scene="narrow_box"),
        Case(name="box 0.45 m wide", scene="wide_box"),
        Case(name="load 10 cm ahead", fixed={"object_com_offset_x": 0.1}),
        Case(name="load 8 cm to the left", fixed={"object_com_offset_y": 0.08}),
        Case(name="held by friction", scene="squeeze"),
        Case(name="bow 1.4 rad", sequence=(*BOWING, Segment(duration=3.0, ramp=2.5), *WALKING_ON)),
        Case(name="60 s", repetitions=3),
    )
    """Conditions, by default with a 4 kg box: twice the largest bias in training of encoders [rad], IMU [rad] and
    gyroscope [rad/s]; twice its change of gains and loss of motor strength, the latter also with its smallest linkage
    effort; action and sensor latency of one and a half control periods each; friction below its smallest; 30 kg crates
    at both ends of the rolling resistance; boxes narrower and wider than its 0.25 m; loads further off-centre than its
    3 cm; a box held by friction alone; nearly the paper's deepest bow; three sequences in a row."""
    pushes: PushLadder | None = PushLadder()
    """Pushes on the base while standing; empty: none."""
    walking_pushes: PushLadder | None = PushLadder(time=4.0, sequence=WALKING)
    """Pushes on the base while walking; empty: none."""


class PushMap(Section):
    """Pushes over a grid of rolling resistance and mass, because mass alone does not determine the required force."""

    scene: ObjectScene = "push"
    """Scene of `simulation.scenes` with a crate."""
    rolling_resistances: Ascending = (0.02, 0.06, 0.1, 0.15)
    """Rolling resistances μ; the ends are those of the paper's Table I."""
    masses: Ascending = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
    """Masses [kg]."""
    partner_share: float = Field(default=0.0, ge=-1, le=1)
    """Fraction of the rolling resistance that the partner overcomes."""
    trials: int | None = Field(default=5, ge=1, le=10_000)
    """Trials of each pair; empty: `eval.trials`. Few suffice, since neighbouring results support each other."""
    sequence: tuple[Segment, ...] = ()
    """Commands; empty: those of the sweeps."""


class Probe(Section):
    """Linear regression of the object's mass on the policy's observations, in trials with evenly spread masses, of
    which every other one is for the test: no tested mass was trained on."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object."""
    masses: Annotated[tuple[PositiveFloat, PositiveFloat], AfterValidator(ascending)] = (1.0, 10.0)
    """Lightest and heaviest object [kg]; the trials' masses are spread evenly between them. The default is the range of
    box masses in training."""
    trials: int = Field(default=180, ge=20, le=2000)
    """Number of trials, each with its own mass and seed. Each trial draws some 70 random quantities: a regression on
    fewer trials than that cannot distinguish the mass from the others."""
    seed: int = Field(default=9000, ge=0, lt=2**32)
    """Seed of the first trial; distinct from those of training, its checks, evaluation and export."""
    partner_share: PartnerShare = 0.0
    """Fraction of the weight that a partner bears, as in a sweep. It is zero by default, because the hands feel only
    the remaining weight."""
    fixed: Held = Field(default_factory=dict)
    """Fixed values of other randomized quantities, by name."""
    sequence: tuple[Segment, ...] = Field(default=PROBED, min_length=1)
    """Commands of a trial, in order; gentle, so that few end early."""
    interval: float = Field(default=0.5, gt=0)
    """Time between two samples [s]: the length of a history of 25 observations, so that samples share none."""


class Impedance(Section):
    """Sinusoidal forces on the centre of mass of a held object; its motion yields the mechanical impedance. The robot
    stands and holds the object alone; afterwards it must walk."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, gt=0)
    """Object mass [kg]."""
    directions: Annotated[tuple[Literal["x", "y"], ...], Distinct] = Field(default=("x", "y"), min_length=1)
    """Directions of the pull: forward (x) and to the left (y) of the commanded heading."""
    frequencies: Annotated[tuple[PositiveFloat, ...], Distinct] = Field(default=(0.2, 0.5, 1.0, 2.0), min_length=1)
    """Frequencies [Hz]: from that of yielding to a leading partner to that of steps."""
    amplitude: float = Field(default=10.0, gt=0)
    """Amplitude of the force [N]; small compared with the partner's 80 N, large compared with balancing motion."""
    begin: float = Field(default=2.0, ge=0)
    """Start of the pull [s]."""
    cycles: int = Field(default=3, ge=2)
    """Smallest number of periods of a pull; the first one is not measured."""
    shortest: float = Field(default=6.0, gt=0)
    """Smallest duration of a pull [s]; it lasts a whole number of periods."""
    walk: tuple[Segment, ...] = Field(default=WALKING_ON, min_length=1)
    """Commands after the pull; a robot that stands still fails them."""


class Compliance(Section):
    """Partners of different behaviour, a blocked crate, and sinusoidal pulls; without random impulses and pushes, so
    that all forces are interaction forces."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object that is held."""
    masses: Annotated[tuple[PositiveFloat, ...], Distinct] = Field(default=(4.0,), min_length=1)
    """Object masses [kg]."""
    partner_shares: Annotated[tuple[SignedShare, ...], Distinct] = Field(default=(0.5,), min_length=1)
    """Fractions of the weight that the partner bears."""
    behaviours: Annotated[tuple[Behaviour, ...], Distinct] = BEHAVIOURS
    """Partner behaviours, one case each; the last two never occur in training."""
    trials: int | None = Field(default=None, ge=1, le=10_000)
    """Trials of each case; empty: `eval.trials`."""
    sequence: tuple[Segment, ...] = ()
    """Commands; empty: those of the sweeps."""
    blocked: Case | None = BLOCKED
    """Push against an immovable crate; empty: none."""
    impedance: Impedance | None = Impedance()
    """Sinusoidal pulls; empty: none."""
