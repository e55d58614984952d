"""Terms and weights of the reward."""

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from iowbc.recipe.beside import OwnFunction
from iowbc.recipe.section import LATER, OwnName, Section


class Kernel(Section):
    """A term weight·exp(−error²/width²), between 0 and its weight."""

    weight: float
    """Reward a second at zero error."""
    width: float = Field(gt=0.0)
    """Error at which the term has fallen to 37 %, in the unit of the error."""


class Synchronisation(Section):
    """r_sync: coupled motion consistency (eq. 8)."""

    support_reference: Kernel = Kernel(weight=1.0, width=0.8)
    """‖θ_S − θ_S_ref‖ [rad]."""
    lateral_reference: Kernel = Kernel(weight=0.0, width=0.5)
    """The same over the support joints that do not turn about the lateral axis. It takes the place of the term above
    where θ_S_ref is a constant posture: the other joints have to leave that for the height and pitch commanded."""
    system_velocity: Kernel = Kernel(weight=1.5, width=0.25)
    """‖v_sys − v_coll‖ in the plane, filtered [m/s]; narrow, because at 0.5 m/s standing still would score well."""
    yaw_rate: Kernel = Kernel(weight=0.5, width=0.4)
    """Filtered yaw rate against its command [rad/s]."""
    progress: float = 5.0
    """Weight of v_sys along the commanded velocity, no more than commanded [m/s]: at 0.4 m/s it gives 2 a second. The
    kernel alone gives a robot that steps in place 0.08 of its weight and next to no slope, and it stays there."""
    turning: float = 1.5
    """Weight of the yaw rate towards the commanded one, no more than commanded [rad/s]."""
    heading: Kernel = Kernel(weight=1.0, width=0.3)
    """Heading against the integrated command [rad]; rates alone let it drift by 0.4 rad in 20 s."""
    height: Kernel = Kernel(weight=1.0, width=0.08)
    """Height against its command [m]."""
    torso_pitch: Kernel = Kernel(weight=1.0, width=0.2)
    """Torso pitch against its command [rad]."""
    torso_roll: float = -2.0
    """Weight of the torso's roll squared [rad²]."""
    filter_time: float = Field(default=0.2, gt=0.0)
    """Time constant of the filter on velocity and yaw rate [s]; the raw yaw rate is mostly exploration noise."""


class ObjectEquilibrium(Section):
    """r_obj: deviation of the object's pose, and the vertical motion of a held one."""

    position: float = -4.0
    """Weight of the squared distance of the object from its place in the grasp, heading frame [m²]."""
    orientation: float = -0.5
    """Weight of the squared tilt of the object against gravity, sin² of the angle."""
    link_contact: float = -0.01
    """Weight of the force of links other than the hands on the object [N]: 50 N of a box that rests in the lap cost as
    much as being alive brings. What thighs and torso carry is not carried."""
    largest_link_contact: float = Field(default=200.0, ge=0.0, json_schema_extra=LATER)
    """Force beyond which `link_contact` costs no more [N]: a box of 20 kg in the lap; blows beyond say no more."""
    beside: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of the squared distance to the side of a pushed object from the middle of the hands, heading frame [m²]. A
    crate that two palms push drifts to a side unless it is steered, and is lost at half its width."""
    largest_beside: float = Field(default=0.5, gt=0.0, json_schema_extra=LATER)
    """Distance beyond which `beside` costs no more [m]: such a crate is lost."""
    vertical_velocity: float = -0.5
    """Weight of the squared vertical velocity beyond the one that a commanded change of height asks for [m²/s²]."""


class Smoothness(Section):
    """r_smooth: what wears a robot out."""

    joint_acceleration: float = -2.5e-7
    """Weight of Σ q̈² over all joints [rad²/s⁴]."""
    action_rate: float = -0.02
    """Weight of ‖a_t − a_{t−1}‖²."""
    action_curvature: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of ‖a_t − 2a_{t−1} + a_{t−2}‖²: what a policy makes of sensor noise."""
    effort: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of Σ max(|τ|/τ_max − `comfortable_effort`, 0)² over all joints: motors near their limit overheat."""
    comfortable_effort: float = Field(default=0.5, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Part of the torque limit up to which `effort` costs nothing."""
    power: float = -1.0e-3
    """Weight of Σ |τ·q̇| [W]."""
    base_rates: float = -0.05
    """Weight of the squared roll and pitch rates of the base [rad²/s²]."""
    vertical_velocity: float = -0.5
    """Weight of the squared vertical velocity of the base [m²/s²]."""
    saturation: float = -0.5
    """Weight of the fraction of support joints at their torque limit."""


class GaitConstraint(Section):
    """r_gait: swing height and contact timing by the phase."""

    contact_timing: float = 1.0
    """Weight of the fraction of feet whose contact is what the phase asks for, counted from −1 to 1."""
    swing_height: Kernel = Kernel(weight=1.5, width=0.04)
    """Height of the swinging foot against the gait prior's profile [m]; only while a foot swings."""
    foot_slip: float = -1.0
    """Weight of the speed at which the soles slide, averaged by the weight that each bears [m/s]. Squared, a slide of
    0.1 m/s cost next to nothing, and feet that walked slid 0.3 m a metre."""
    touchdown: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of the squared downward velocity of both soles near the ground [m²/s²], which fades with their height over
    `touchdown_height`."""
    touchdown_height: float = Field(default=0.02, gt=0.0, json_schema_extra=LATER)
    """Height of a sole at which `touchdown` counts 37 % [m]."""
    standing: float = -1.0
    """Weight of the number of feet off the ground while the clock rests."""
    recovery: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of steps while no velocity is commanded. Without a cost the terms of the swinging foot, 1 a second, pay
    for stepping in place, and a robot with `references.gait.recovery` never stands still."""
    foot_distance: float = -5.0
    """Weight of the squared lack of lateral distance between the feet [m²]."""
    smallest_foot_distance: float = Field(default=0.16, ge=0.0)
    """Lateral distance of the feet below which `foot_distance` counts [m]."""


class Yielding(Section):
    """Compliance to what pushes the hands horizontally: partner, impulses, a blocked crate.

    The paper tracks v_coll whatever the force, the default. With a damping b, velocity terms and curriculum ask for
    v_coll + F/b, F being the horizontal force of the object on the hands beyond what the transport needs.
    """

    held: float | None = Field(default=None, gt=0.0)
    """Damping b of a held object [N·s/m]; empty is infinite, as in the paper. At 60 a partner that stands still while
    0.5 m/s are commanded is followed at 40 N."""
    pushed: float | None = Field(default=None, gt=0.0)
    """Damping b of a pushed crate [N·s/m]; empty is infinite. At 280 a robot leans on a blocked crate with 75 N a hand
    while 0.5 m/s are commanded: over half of what the friction of its feet allows, and under 90 N."""
    margin: float = Field(default=10.0, ge=0.0)
    """Force that is never answered [N]: what an 8 kg box needs to follow the steps of a gait."""
    largest_speed: float = Field(default=0.6, gt=0.0)
    """Largest change of the velocity that is asked for [m/s]; the top speed of commands."""
    force: float = 0.0
    """Weight of the force beyond the margin and b·|v_coll|, at which the robot should have yielded altogether [N]."""
    largest_force: float = Field(default=100.0, gt=0.0)
    """Force beyond which `force` costs no more [N]: a blow says no more."""


class OwnTerm(OwnFunction):
    """A term that is a function in a file of one's own. It takes a `Step` (iowbc/task/rewards/table.py) of n
    environments and returns a value for each, (n,)."""

    weight: float
    """Reward a second at the value 1; at 0 the file is not executed, and no key knows of the term."""
    width: float | None = Field(default=None, gt=0.0)
    """Makes it a kernel: the value, (n,) or (n, k), is a squared error, and the reward falls to 37 % at this error."""

    @property
    def idle(self) -> bool:
        return self.weight == 0.0


class Later(Section):
    """Weights that take over as an environment's level of locomotion rises."""

    begin: float = Field(default=0.5, ge=0.0, le=2.0)
    """Level of locomotion up to which the terms' own weights count."""
    end: float = Field(default=0.9, ge=0.0, le=2.0)
    """Level from which on these count; between the two they are interpolated."""
    weights: dict[str, float] = Field(default_factory=dict)
    """Weight by the dotted path of a term in this section, as `sync.progress`: it teaches to walk, and once a robot
    walks makes it hurry."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.begin >= self.end:
            yield "", f"begin {self.begin:g} must be below end {self.end:g}"


class Reward(Section):
    """Sum of the terms, per second; a step's reward is the sum times the control period, plus the cost of a fall."""

    sync: Synchronisation = Synchronisation()
    """Coupled motion consistency."""
    object: ObjectEquilibrium = ObjectEquilibrium()
    """Object equilibrium."""
    smooth: Smoothness = Smoothness()
    """Whole-body smoothness."""
    gait: GaitConstraint = GaitConstraint()
    """Gait constraint."""
    yielding: Yielding = Field(default=Yielding(), json_schema_extra=LATER)
    """Compliance of hands and velocity."""
    without: tuple[Literal["sync", "object", "smooth", "gait"], ...] = Field(default=(), json_schema_extra=LATER)
    """Groups of terms that count nothing, whatever their weights: ablations of r_sync, r_obj, r_smooth, r_gait."""
    alive: float = 0.5
    """Reward a second for not having fallen."""
    termination: float = -3.0
    """Added once when an episode ends in a fall or a drop, not scaled by the control period."""
    later: Later | None = Field(default=None, json_schema_extra=LATER)
    """Weights of a robot that walks; empty keeps them as they are."""
    own: dict[OwnName, OwnTerm] = Field(default_factory=dict, json_schema_extra=LATER)
    """Terms of one's own, by a name for their curve; training alone executes them."""

    def problems(self) -> Iterator[tuple[str, str]]:
        groups = {name: value for name, value in self if isinstance(value, Section) and name != "later"}
        terms = {"alive", "termination"} | {
            f"{group}.{name}"
            for group, section in groups.items()
            for name, value in section
            if isinstance(value, float | Kernel)
        }
        for unknown in sorted(set(self.later.weights if self.later else ()) - terms):
            yield "", f"later.weights: no term {unknown!r}; valid: {', '.join(sorted(terms))}"

    @property
    def own_terms(self) -> dict[str, OwnTerm]:
        """Those with a weight."""
        return {name: term for name, term in self.own.items() if not term.idle}
