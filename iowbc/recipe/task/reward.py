"""Terms and weights of the reward."""

from typing import Literal

from pydantic import Field

from iowbc.recipe.beside import CustomFunction
from iowbc.recipe.section import LATER, CustomName, Problems, Section


class Kernel(Section):
    """A term weight·exp(−error²/width²), between 0 and its weight."""

    weight: float
    """Reward per second at zero error."""
    width: float = Field(gt=0.0)
    """Error at which the term has fallen to 37 %, in the unit of the error."""


class Synchronisation(Section):
    """r_sync: coupled motion consistency (eq. 8)."""

    support_reference: Kernel = Kernel(weight=1.0, width=0.8)
    """‖θ_S − θ_S_ref‖ [rad]."""
    lateral_reference: Kernel = Kernel(weight=0.0, width=0.5)
    """The same norm over the support joints that do not rotate about the lateral axis. It replaces `support_reference`
    if θ_S_ref is a constant posture, from which the other joints must deviate to follow commanded height and pitch."""
    system_velocity: Kernel = Kernel(weight=1.5, width=0.25)
    """‖v_sys − v_coll‖ in the plane, filtered [m/s]; with a width of 0.5 m/s, standing still would score well."""
    yaw_rate: Kernel = Kernel(weight=0.5, width=0.4)
    """Error of the filtered yaw rate [rad/s]."""
    progress: float = 5.0
    """Weight of v_sys along the commanded velocity, clipped to it [m/s]: 2 per second at 0.4 m/s. The kernel alone
    gives a robot that steps in place 0.08 of its weight and almost no gradient, so that it does not learn to walk."""
    turning: float = 1.5
    """Weight of the yaw rate in the commanded direction, clipped to the commanded rate [rad/s]."""
    heading: Kernel = Kernel(weight=1.0, width=0.3)
    """Heading error against the integrated command [rad]; with rate terms only, it drifts by 0.4 rad in 20 s."""
    height: Kernel = Kernel(weight=1.0, width=0.08)
    """Height error [m]."""
    torso_pitch: Kernel = Kernel(weight=1.0, width=0.2)
    """Torso pitch error [rad]."""
    torso_roll: float = -2.0
    """Weight of the squared tilt of the torso to a side [rad²]."""
    filter_time: float = Field(default=0.2, gt=0.0)
    """Time constant of the filter on velocity and yaw rate [s]; the raw yaw rate is mostly exploration noise."""


class ObjectEquilibrium(Section):
    """r_obj: deviation of the object's pose, and the vertical motion of a held one."""

    position: float = -4.0
    """Weight of the squared distance of the object from its place in the grasp, heading frame [m²]."""
    orientation: float = -0.5
    """Weight of the squared tilt of the object against gravity, sin² of the angle."""
    link_contact: float = -0.01
    """Weight of the force of links other than the hands on the object [N]. 50 N of a box that rests on the lap cost as
    much as `alive` gives; the hands, not thighs and torso, are to carry it."""
    largest_link_contact: float = Field(default=200.0, ge=0.0, json_schema_extra=LATER)
    """Force at which `link_contact` saturates [N]: that of a 20 kg box on the lap."""
    beside: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of the squared lateral distance of a pushed object from the midpoint of the hands, heading frame [m²]. A
    crate pushed by two palms drifts sideways unless it is steered, and is lost at half its width."""
    largest_beside: float = Field(default=0.5, gt=0.0, json_schema_extra=LATER)
    """Distance at which `beside` saturates [m]; the crate is lost there."""
    vertical_velocity: float = -0.5
    """Weight of the squared vertical velocity beyond that of a commanded change of height [m²/s²]."""


class Smoothness(Section):
    """r_smooth: costs of motion that wears the robot."""

    joint_acceleration: float = -2.5e-7
    """Weight of Σ q̈² over all joints [rad²/s⁴]."""
    action_rate: float = -0.02
    """Weight of ‖a_t − a_{t−1}‖²."""
    action_curvature: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of ‖a_t − 2a_{t−1} + a_{t−2}‖²: a policy's response to sensor noise."""
    effort: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of Σ max(|τ|/τ_max − `comfortable_effort`, 0)² over all joints: motors near their limit overheat."""
    comfortable_effort: float = Field(default=0.5, ge=0.0, le=1.0, json_schema_extra=LATER)
    """Fraction of the torque limit up to which `effort` costs nothing."""
    power: float = -1.0e-3
    """Weight of Σ |τ·q̇| [W]."""
    base_rates: float = -0.05
    """Weight of the squared roll and pitch rates of the base [rad²/s²]."""
    vertical_velocity: float = -0.5
    """Weight of the squared vertical velocity of the base beyond that of a commanded change of height [m²/s²]."""
    saturation: float = -0.5
    """Weight of the fraction of support joints at their torque limit."""


class GaitConstraint(Section):
    """r_gait: swing height and contact timing by the gait phase."""

    contact_timing: float = 1.0
    """Weight of the fraction of feet whose contact state matches the gait phase, scaled to −1 to 1."""
    swing_height: Kernel = Kernel(weight=1.5, width=0.04)
    """Height error of the swing foot against the gait prior's profile [m]; only while a foot swings."""
    foot_slip: float = -1.0
    """Weight of the sliding speed of the soles, averaged with the load of each as weight [m/s]. With squared speeds, a
    slide of 0.1 m/s cost almost nothing, and walking feet slid 0.3 m per metre."""
    touchdown: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of the squared downward velocity of both soles near the ground [m²/s²], which fades with their height over
    `touchdown_height`."""
    touchdown_height: float = Field(default=0.02, gt=0.0, json_schema_extra=LATER)
    """Height of a sole at which `touchdown` counts 37 % [m]."""
    standing: float = -1.0
    """Weight of the number of feet off the ground while the clock rests."""
    recovery: float = Field(default=0.0, json_schema_extra=LATER)
    """Weight of steps while no velocity is commanded. Without this cost the swing terms, 1 per second, reward stepping
    in place, and a robot with `references.gait.recovery` never stands still."""
    foot_distance: float = -5.0
    """Weight of the squared shortfall of the feet's lateral distance from `smallest_foot_distance` [m²]."""
    smallest_foot_distance: float = Field(default=0.16, ge=0.0)
    """Lateral distance of the feet below which `foot_distance` counts [m]."""


class Yielding(Section):
    """Compliance to horizontal forces on the hands: of a partner, impulses, or a blocked crate.

    By default v_coll is tracked regardless of the force, as in the paper. With a damping b, velocity terms and
    curriculum track v_coll + F/b, where F is the horizontal force of the object on the hands beyond what the transport
    needs.
    """

    held: float | None = Field(default=None, gt=0.0)
    """Damping b of a held object [N·s/m]; empty: infinite, as in the paper. At 60 a robot commanded to move at 0.5 m/s
    stays with a partner that stands still at a force of 40 N."""
    pushed: float | None = Field(default=None, gt=0.0)
    """Damping b of a pushed crate [N·s/m]; empty: infinite. At 280 a robot leans on a blocked crate with 75 N per hand
    at a command of 0.5 m/s: over half of what the friction of its feet allows, and under 90 N."""
    margin: float = Field(default=10.0, ge=0.0)
    """Force without a response [N]: what an 8 kg box needs to follow the steps of a gait."""
    largest_speed: float = Field(default=0.6, gt=0.0)
    """Largest change of the target velocity [m/s]; the top speed of commands."""
    force: float = 0.0
    """Weight of the force beyond the margin and b·|v_coll|, at which the robot should have yielded completely [N]."""
    largest_force: float = Field(default=100.0, gt=0.0)
    """Force at which `force` saturates [N], so that impacts cost no more."""


class CustomTerm(CustomFunction):
    """Custom reward term: a function in a user's file. It takes a `Step` (iowbc/task/rewards/table.py) of n
    environments and returns a value for each, (n,)."""

    weight: float
    """Reward per second at the value 1; at 0 the file is not executed, and the key does not depend on the term."""
    width: float | None = Field(default=None, gt=0.0)
    """Width of a kernel: the value, (n,) or (n, k), is then a squared error; the reward falls to 37 % at this error."""

    @property
    def idle(self) -> bool:
        return self.weight == 0.0


class Later(Section):
    """Schedule of reward weights over an environment's level of locomotion."""

    begin: float = Field(default=0.5, ge=0.0, le=2.0)
    """Level of locomotion up to which the terms' own weights apply."""
    end: float = Field(default=0.9, ge=0.0, le=2.0)
    """Level from which the later weights apply; weights are interpolated between the two levels."""
    weights: dict[str, float] = Field(default_factory=dict)
    """Later weight by the dotted path of a term in `task.reward`, such as `sync.progress`, which teaches walking but
    makes a robot that walks hurry."""

    def problems(self) -> Problems:
        if self.begin >= self.end:
            yield "", f"begin {self.begin:g} must be below end {self.end:g}"


class Reward(Section):
    """Sum of the terms, per second; a step's reward is the sum times the control period, plus the cost of a fall."""

    sync: Synchronisation = Synchronisation()
    object: ObjectEquilibrium = ObjectEquilibrium()
    smooth: Smoothness = Smoothness()
    gait: GaitConstraint = GaitConstraint()
    yielding: Yielding = Field(default=Yielding(), json_schema_extra=LATER)
    without: tuple[Literal["sync", "object", "smooth", "gait"], ...] = Field(default=(), json_schema_extra=LATER)
    """Groups of terms to disable, for ablations of r_sync, r_obj, r_smooth, r_gait."""
    alive: float = 0.5
    """Reward per second for not having fallen."""
    termination: float = -3.0
    """Reward of an end in a fall or a drop, given once and not scaled by the control period."""
    later: Later | None = Field(default=None, json_schema_extra=LATER)
    """Weights for robots that walk; empty: constant weights."""
    own: dict[CustomName, CustomTerm] = Field(default_factory=dict, json_schema_extra=LATER)
    """Custom terms by name, which is also that of their training curve; only training executes them."""

    def problems(self) -> Problems:
        groups = {name: value for name, value in self if isinstance(value, Section) and name != "later"}
        terms = {"alive", "termination"} | {
            f"{group}.{name}"
            for group, section in groups.items()
            for name, value in section
            if isinstance(value, Kernel) or (isinstance(value, float) and not type(section).model_fields[name].metadata)
        }  # weights have no bounds, unlike parameters of terms
        for unknown in sorted(set(self.later.weights if self.later else ()) - terms):
            yield "", f"later.weights: no term {unknown!r}; valid: {', '.join(sorted(terms))}"

    @property
    def own_terms(self) -> dict[str, CustomTerm]:
        """Custom terms whose weight is not zero."""
        return {name: term for name, term in self.own.items() if not term.idle}
