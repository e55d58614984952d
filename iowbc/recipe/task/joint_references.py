"""Joint references computed from a command."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from iowbc.recipe.section import LATER, NamedEntries, Problems, Section, Vector


class Grasps(NamedEntries):
    """Base grasp of each scene: left wrist relative to the pelvis, heading frame [m]; the right one mirrors it."""

    __pydantic_extra__: dict[str, Vector] = Field(init=False)
    free: Vector = (0.30, 0.16, 0.12)
    """Forearms before the body, as when carrying."""
    lift: Vector = (0.30, 0.16, 0.26)
    """At the object's sides, its near face 5 cm ahead of the torso, high enough to clear the thighs down to H = 0.5 m;
    14 cm lower, hands carry only 18 % of 8 kg at that height."""
    squeeze: Vector = (0.30, 0.16, 0.26)
    """As in `lift`."""
    tyre: Vector = (0.30, 0.27, 0.12)
    """At the widest place of the tyre; lower, arms this far apart do not reach."""
    push: Vector = (0.30, 0.16, 0.20)
    """Behind the crate's upper edge."""


class Loads(NamedEntries):
    """Loads that the arm references compensate in each scene [kg]; lighter objects raise the hands, heavier ones lower
    them."""

    __pydantic_extra__: dict[str, Annotated[float, Field(ge=0.0)]] = Field(init=False)
    free: float = Field(default=0.0, ge=0.0)
    """Nothing."""
    lift: float = Field(default=3.5, ge=0.0)
    """Half of the box's nominal mass."""
    squeeze: float = Field(default=3.5, ge=0.0)
    """As in `lift`."""
    tyre: float = Field(default=9.0, ge=0.0)
    """The robot's half of a tyre that two carry; without it, hands sink by 24 cm."""
    push: float = Field(default=0.0, ge=0.0)
    """Nothing."""


class ArmReference(Section):
    """Differential inverse kinematics of the arms (eq. 3)."""

    settling: int = Field(default=5, ge=1, le=1000)
    """Iterations at the start of an episode that bring the arms near the grasp and to their rest posture."""
    refining: int = Field(default=3, ge=0, le=1000)
    """Further iterations that bring the wrists to their targets; without them, arms creep in the first seconds."""
    settling_time: float = Field(default=0.3, gt=0.0)
    """Time step of a settling iteration [s]; longer steps favour the rest posture over the targets of the wrists."""
    refining_time: float = Field(default=0.02, gt=0.0)
    """Time step of a refining iteration [s]: a control period, so that the episode continues without a jump."""
    damping: float = Field(default=0.05, gt=0.0)
    """Damping of the pseudo-inverse [m]: joint motion is bounded by |Δx| / (2·damping) next to a singular posture."""
    reach: float = Field(default=0.2, ge=0.0)
    """Squared damping added per metre of error [m]; an arm stretched towards an unreachable target then settles instead
    of overshooting."""
    longest_step: float = Field(default=0.1, gt=0.0)
    """Bound on the error of an iteration [m], so that a wrist approaches a distant target without overshooting."""
    posture_gain: float = Field(default=1.0, ge=0.0)
    """Rate at which the redundant joints return to the rest posture [1/s]; low, because the wrists have priority."""
    gravity: bool = True
    """Compensate gravity: offset the arms' targets by the torques of their own weight and of the expected load, divided
    by the gains. Without it, wrists sag by 4 cm under the arms' weight alone."""
    joint_speed: float | None = Field(default=None, gt=0.0)
    """Bound on the speed of the references [rad/s]; empty: each joint's own limit from `robot.yaml`."""


class Recovery(Section):
    """Recovery steps while no velocity is commanded: the gait clock runs while the base is measured to fall."""

    withdrawn: ClassVar[Mapping[str, Any]] = {"filter_time": 0.0, "turned": False}

    tilt: float = Field(default=0.25, gt=0.0)
    """Predicted tilt relative to the pelvis of the reference posture at which the clock starts [rad]: pitch and roll,
    extrapolated over `horizon`. A quiet robot measures a median of 0.1, and 0.25 in one step of a hundred: up to 0.15
    the clock runs most of the time. At 0.4 steps come too late for 20 N·s."""
    horizon: float = Field(default=0.25, ge=0.0)
    """Time over which the tilt is extrapolated at the measured rate [s]: sqrt(h / g) of a pelvis at 0.7 m, so that the
    sum is the capture point's angle."""


class Placement(Section):
    """Feedback of the estimated forward speed on footholds: a robot that is pushed ahead steps further ahead, and one
    that lags pushes from further behind."""

    gain: float = Field(default=0.15, ge=0.0)
    """Forward shift of a foothold per m/s above the commanded speed [s]. The capture point of a 0.7 m pendulum is 0.27
    s ahead, but the error of the estimated speed is as large as its variation, 0.15 m/s."""
    longest: float = Field(default=0.25, ge=0.0)
    """Largest shift [m]: about half of a leg's swing."""
    filter_time: float = Field(default=0.1, gt=0.0)
    """Averaging time of the measurements before touch-down [s]; joint velocities are noisy."""
    return_time: float = Field(default=0.27, gt=0.0)
    """Time constant of a stance foot's return to its nominal place [s]: sqrt(h / g) of a 0.7 m pendulum."""
    integral: float = Field(default=0.0, ge=0.0, json_schema_extra=LATER)
    """Backward shift of both feet per metre of estimated lag behind the command, so that the robot leans into a push
    [m/m]. Without it, a 10 kg crate moves at 1.18 and a 60 kg crate at 0.56 of the commanded speed; with 0.05 at 1.07
    and 0.74."""
    longest_trim: float = Field(default=0.1, ge=0.0, json_schema_extra=LATER)
    """Largest shift by `integral` [m]: that for 36 N at hands 0.95 m above the ground and a 35 kg robot. With 0.16,
    policies that were not trained with it fall."""


class TorsoFeedback(Section):
    """Feedback of the torso's pitch on both hips, which relieve the waist's motors: these give 35 to 50 N·m, and 8 kg
    in the hands need 54 in a bow of 0.4 rad."""

    integral: float = Field(default=0.1, ge=0.0)
    """Hip rotation rate per radian by which the torso leans further than commanded [1/s]. At 0.3, a policy that was not
    trained with it fails a few more lifts of 4 kg."""
    furthest: float = Field(default=0.15, ge=0.0)
    """Largest backward rotation of the pelvis by the hips [rad]; without it a robot with 8 kg leans 0.2 further."""
    least: float = Field(default=0.05, ge=0.0)
    """Largest forward rotation of the pelvis by the hips [rad]."""


class HeightFeedback(Section):
    """Feedback of the estimated height on the legs, which extend if robot and load bend the knees. Without it, the
    pelvis of an expert is 2 cm too low with 4 kg, and 4 cm with 8 kg."""

    integral: float = Field(default=0.5, ge=0.0)
    """Extension rate of both legs per metre by which the pelvis is too low [1/s]."""
    furthest: float = Field(default=0.05, ge=0.0)
    """Largest extension or retraction [m]."""


class GaitPrior(Section):
    """The gait clock, and the stride that it adds to the support reference while a velocity is commanded."""

    withdrawn: ClassVar[Mapping[str, Any]] = {"posture": None}

    enabled: bool = True
    """Add the stride to the support reference; otherwise the reference is the paper's, and the clock still runs."""
    frequency: float = Field(default=1.35, gt=0.0)
    """Stride frequency [Hz]."""
    stance: float = Field(default=0.58, gt=0.5, lt=1.0)
    """Duty factor: fraction of the stride in which a foot is on the ground; above one half there are two double-support
    phases per stride."""
    stride: float = Field(default=1.0, ge=0.0)
    """Fraction of the commanded velocity and yaw rate at which stance feet move under the pelvis: at 1 the reference
    walks as commanded and the policy only corrects it, at 0 it steps in place."""
    swing_clearance: float = Field(default=0.08, gt=0.0)
    """Height of the sole at mid-swing [m], also in the reward's profile."""
    profile: Literal["sine", "rest"] = Field(default="sine", json_schema_extra=LATER)
    """Height over the swing: clearance·sin(π·progress), which lands at 0.81 m/s, or clearance·sin²(π·progress), which
    lifts off and lands at rest."""
    sway: float = Field(default=0.02, ge=0.0)
    """Amplitude of the pelvis' lateral motion over the stance foot [m]. A 0.7 m pendulum that steps from side to side
    every 0.37 s, between feet 0.24 m apart, sways by 0.022 m."""
    spread: float = Field(default=0.0, ge=0.0, le=0.1, json_schema_extra=LATER)
    """Outward shift of each foot relative to the support posture, standing and walking [m]. `compliant_quick` survives
    215 of 240 disturbed trials with 0.04 and 200 without, but pushes 60 kg at two thirds of the pace."""
    straightest_knee: float = Field(default=0.1, gt=0.0)
    """Smallest knee flexion, which limits the length of a stride [rad]; closer to the straight leg, millimetres of
    reach are tenths of a radian."""
    moving_speed: float = Field(default=0.05, gt=0.0)
    """Commanded planar speed above which the clock runs [m/s]."""
    moving_yaw_rate: float = Field(default=0.1, gt=0.0)
    """Commanded yaw rate above which the clock runs [rad/s]."""
    recovery: Recovery | None = Field(default=None, json_schema_extra=LATER)
    """Recovery steps while standing, after a push; empty: the clock depends on the command only."""
    placement: Placement | None = Field(default=None, json_schema_extra=LATER)
    """Feedback of the estimated forward speed on footholds; empty: none."""

    def problems(self) -> Problems:
        if self.placement is not None and not self.enabled:
            yield "", "placement: moves the feet of the gait prior, which is off (`enabled: false`); empty it"


class References(Section):
    """Joint references computed from a command: base grasp, arm kinematics, reference generator, gait prior."""

    use_rg: bool = True
    """Take θ_S_ref from the reference generator; otherwise it is the constant default posture ("w/o RG")."""
    grasps: Grasps = Grasps()
    lean: float = Field(default=0.3, ge=0.0)
    """Forward shift of the grasps at a torso pitch of 90° [m], proportional to the sine of the pitch. It is that of the
    chest at the height of the object's upper edge, so that the torso does not rest on the object."""
    loads: Loads = Loads()
    largest_pitch: float | None = Field(default=None, gt=0.0, le=1.6, json_schema_extra=LATER)
    """Torso pitch to which commands are clamped, within the feasible map [rad]. The map contains all commands with a
    support posture in equilibrium; a policy may achieve less. Empty: only the map clamps."""
    upright: bool = Field(default=False, json_schema_extra=LATER)
    """Ignore commanded height and pitch in the references. This is for controllers that take velocities only: their
    torso does not follow, and the arms would reach to the wrong place."""
    arms: ArmReference = ArmReference()
    gait: GaitPrior = GaitPrior()
    torso: TorsoFeedback | None = Field(default=None, json_schema_extra=LATER)
    """Feedback of the torso's pitch on the hips; empty: none."""
    height: HeightFeedback | None = Field(default=None, json_schema_extra=LATER)
    """Feedback of the height on the legs; empty: none."""

    def problems(self) -> Problems:
        if self.height is not None and not self.gait.enabled:
            yield "", "height: stretches the legs of the gait prior, which is off (`gait.enabled: false`); empty it"
        for name, grasp in self.grasps:
            if grasp[1] <= 0.0:
                text = f"the left wrist's y is {grasp[1]}, it must be positive (left of the body)"
                yield "", f"grasps.{name}: {text}"
