"""Groups of trials: sweeps over mass, single cases, pushes that grow until the robot falls, a map of pushes, a probe of
the history, and interaction with partners."""

from collections.abc import Iterator
from typing import Annotated, Literal, get_args

from pydantic import Field, PositiveFloat

from iowbc.recipe.evaluation.sequences import BOWING, PROBED, STAGNATION, STANDING, WALKING, WALKING_ON, Segment
from iowbc.recipe.section import Ascending, Masses, Section
from iowbc.recipe.simulation.holding import Held, ObjectScene
from iowbc.recipe.simulation.partner import BEHAVIOURS

PartnerShare = Annotated[float, Field(ge=-1, le=1)] | None


class Beyond(Section):
    """Continuation of a sweep past its last mass, until nothing survives."""

    step: float = Field(default=2.0, gt=0)
    """Mass added at a time [kg]."""
    limit: float = Field(default=30.0, gt=0)
    """No mass above this is tried [kg]."""


class WithShare(Section):
    """Deviations of a sweep where the partner has a certain share."""

    partner_share: float = Field(ge=-1, le=1)
    """The share, one of the sweep's."""
    masses: Masses | None = Field(default=None, min_length=1)
    """Object masses [kg], ascending; empty takes the sweep's."""
    rolling_resistance: float | None = Field(default=None, ge=0, le=1)
    """Rolling resistance μ; empty takes the sweep's."""


class MassSweep(Section):
    """Trials over a range of object masses in one scene."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes` or `eval.scenes` in which the object is met."""
    masses: Masses = Field(default=(0.05, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0), min_length=1)
    """Object masses [kg], ascending; none is lighter than the object's `smallest_mass`."""
    no_object: bool = True
    """Also play the commands once in the scene without an object, without a partner: the row "no object"."""
    undisturbed: Masses = ()
    """Masses of a second suite without impulses and pushes [kg], where `eval.disturbances` are on; empty has none."""
    beyond: Beyond | None = None
    """Heavier masses, tried as long as one trial survives; empty stops at the last mass."""
    rolling_resistance: float | None = Field(default=None, ge=0, le=1)
    """Rolling resistance μ of the crate's wheels; empty draws it as in training."""
    partner_shares: tuple[PartnerShare, ...] = Field(default=(0.0, 0.5), min_length=1)
    """The sweep is made once with each: part of the weight, or in pushing of the rolling resistance, that the partner
    bears; negative resists, 0 leaves all of it to the robot, empty draws it as in training."""
    with_share: tuple[WithShare, ...] = ()
    """Other masses, or another rolling resistance, for some of these shares."""
    fixed: Held = Field(default_factory=dict)
    """Any other randomised quantity that is held at a value instead of being drawn, by its name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this sweep; empty takes `eval.sequence`, or else `eval.scripts`, or else that of lifting or
    pushing."""

    def at(self, share: float | None) -> "MassSweep":
        """The sweep as it is with one share of the partner's."""
        own = [one for one in self.with_share if one.partner_share == share]
        given = {name: value for one in own for name, value in one if value is not None and name != "partner_share"}
        return self.model_copy(update={**given, "partner_shares": (share,), "with_share": ()})

    def problems(self) -> Iterator[tuple[str, str]]:
        if len(set(self.partner_shares)) != len(self.partner_shares):
            yield "", f"partner_shares must differ, got {list(self.partner_shares)}"
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
    """Object mass [kg]; a mass of 0 is played in the scene without an object."""
    rolling_resistance: float | None = Field(default=None, ge=0)
    """Rolling resistance μ of the crate's wheels; empty draws it as in training."""
    partner_share: PartnerShare = 0.0
    """As in a sweep."""
    fixed: Held = Field(default_factory=dict)
    """Any other randomised quantity that is held at a value instead of being drawn, by its name."""
    sequence: tuple[Segment, ...] = ()
    """Command sequence of this case; empty takes `eval.sequence`, or else `eval.scripts`, or else that of lifting or
    pushing."""
    repetitions: int = Field(default=1, ge=1)
    """Times that the sequence is played in a row; drawn scripts differ from one to the next."""


class HeavyCase(Case):
    """One of the paper's heavy tasks, reported by its success rate."""

    partner_share: PartnerShare = 0.5
    """As in a sweep; half of the load by default, for these are carried by two."""


class Stagnation(Section):
    """Pushes that cannot succeed (paper IV-D). Success is to go on pushing, upright in posture, on feet that do not
    slide; E_v is expected to be large."""

    cases: tuple[Case, ...] = Field(
        default=(
            Case(
                name="blocked crate",
                scene="push",
                mass=65.0,
                fixed={"resistance_scale": 50.0, "ground_friction": 0.5},
                sequence=STAGNATION,
            ),
        ),
        min_length=1,
    )
    """With fifty times its rolling resistance the 65 kg crate resists with 638 N or more, where foot friction of 0.5,
    the least of training, allows 164 N. On better ground a robot in the commanded posture tips over before it pushes
    with half of what friction allows."""


Direction = Literal[
    "forward", "forward left", "left", "backward left", "backward", "backward right", "right", "forward right"
]
EIGHT: tuple[Direction, ...] = get_args(Direction)


class PushLadder(Section):
    """Pushes on the base that grow until the robot falls: the impulse survived in each direction. The robot has to
    walk after it."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, ge=0)
    """Object mass [kg]."""
    directions: tuple[Direction, ...] = EIGHT
    """Horizontal directions in the frame of the robot's heading."""
    trials: int | None = Field(default=5, ge=1, le=10_000)
    """Trials of each size and direction; empty takes `eval.trials`. Few, for neighbours support each other."""
    impulses: Ascending = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
    """Sizes tried [N·s], ascending; 37 N·s would give robot and 4 kg box 1 m/s in the air."""
    time: float = Field(default=2.0, ge=0)
    """When the push begins [s]."""
    duration: float = Field(default=0.1, gt=0)
    """Time over which it acts, as a constant force [s]."""
    sequence: tuple[Segment, ...] = Field(default=STANDING, min_length=1)
    """Commands while it is pushed."""


class Robustness(Section):
    """Trials that the paper does not have: conditions outside of the training's, long trials, pushes until the robot
    falls."""

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
    """Conditions with a 4 kg box: twice the training's largest bias of encoders [rad], inertial unit [rad], gyroscope
    [rad/s], twice its change of gains and loss of strength, the least that the linkages give in training besides,
    actions and sensors late by one and a half control periods each, less than training's least friction, 30 kg crates
    at both ends of the rolling resistance, boxes narrower and wider than training's 0.25 m, loads further from the
    middle than training's 3 cm, palms that hold the box by nothing but friction, the paper's deepest bow, three
    sequences in a row."""
    pushes: PushLadder | None = PushLadder()
    """Pushes on the base while standing; empty leaves them out."""
    walking_pushes: PushLadder | None = PushLadder(time=4.0, sequence=WALKING)
    """Pushes on the base while walking; empty leaves them out."""


class PushMap(Section):
    """Pushes at every rolling resistance and mass: a mass alone says little of how hard a crate is to push."""

    scene: ObjectScene = "push"
    """Scene of `simulation.scenes` with a crate."""
    rolling_resistances: Ascending = (0.02, 0.06, 0.1, 0.15)
    """Rolling resistances μ; the ends are those of the paper's Table I."""
    masses: Ascending = (10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
    """Masses [kg]."""
    partner_share: float = Field(default=0.0, ge=-1, le=1)
    """Part of the rolling resistance that the partner overcomes."""
    trials: int | None = Field(default=5, ge=1, le=10_000)
    """Trials of each pair; empty takes `eval.trials`. Few, for neighbours in the map support each other."""
    sequence: tuple[Segment, ...] = ()
    """Commands; empty takes those of the sweeps."""


class Probe(Section):
    """Trials with masses spread over a range, and a linear regression of the mass on what the policy sees in them.

    Every other trial is regressed on, those between them are tested: the masses tested are none that were learnt.
    """

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object."""
    masses: tuple[PositiveFloat, PositiveFloat] = (1.0, 10.0)
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

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.masses[0] >= self.masses[1]:
            yield "", f"masses must be a lightest and a heavier one, got {list(self.masses)}"


class Impedance(Section):
    """Sinusoidal pulls on the centre of mass of a held object, from whose motion the mechanical impedance follows. The
    robot stands meanwhile and nobody else holds the object; it then has to walk on."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`."""
    mass: float = Field(default=4.0, gt=0)
    """Object mass [kg]."""
    directions: tuple[Literal["x", "y"], ...] = Field(default=("x", "y"), min_length=1)
    """Directions of the pull: forward (x) and to the left (y) of the commanded heading."""
    frequencies: tuple[PositiveFloat, ...] = Field(default=(0.2, 0.5, 1.0, 2.0), min_length=1)
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


class Compliance(Section):
    """Partners that behave in different ways, a crate that is blocked, and sinusoidal pulls; without impulses and
    pushes, so that every force is that of the interaction."""

    scene: ObjectScene = "lift"
    """Scene of `simulation.scenes`, with an object that is held."""
    masses: tuple[PositiveFloat, ...] = Field(default=(4.0,), min_length=1)
    """Object masses [kg]."""
    partner_shares: tuple[float, ...] = Field(default=(0.5,), min_length=1)
    """Parts of the weight that the partner bears."""
    behaviours: tuple[str, ...] = BEHAVIOURS
    """Behaviours of the partner, a case each; the last two are never trained with."""
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

    def problems(self) -> Iterator[tuple[str, str]]:
        for name in self.behaviours:
            if name not in BEHAVIOURS:
                yield "", f"no partner behaviour {name!r}; valid: {', '.join(BEHAVIOURS)}"
