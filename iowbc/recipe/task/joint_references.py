"""Joint references that follow from a command."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from iowbc.recipe.section import LATER, NamedEntries, Section

Vector = tuple[float, float, float]


class Grasps(NamedEntries):
    """Base grasp of each scene: left wrist from the pelvis, heading frame [m]; the right one mirrors it."""

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
    """Loads that the arms expect in each scene [kg]; lighter objects raise the hands, heavier ones lower them."""

    __pydantic_extra__: dict[str, Annotated[float, Field(ge=0.0)]] = Field(init=False)
    free: float = Field(default=0.0, ge=0.0)
    """Nothing."""
    lift: float = Field(default=3.5, ge=0.0)
    """Half of the box's nominal mass."""
    squeeze: float = Field(default=3.5, ge=0.0)
    """As in `lift`."""
    tyre: float = Field(default=9.0, ge=0.0)
    """The robot's half of a tyre that two carry; without, hands sink by 24 cm."""
    push: float = Field(default=0.0, ge=0.0)
    """Nothing."""


class ArmReference(Section):
    """Differential inverse kinematics of the arms (eq. 3)."""

    settling: int = Field(default=5, ge=1, le=1000)
    """Iterations at the start of an episode that bring the arms near the grasp and to their rest posture."""
    refining: int = Field(default=3, ge=0, le=1000)
    """Iterations after that which bring the wrists to their targets; without, arms creep in the first seconds."""
    settling_time: float = Field(default=0.3, gt=0.0)
    """Time that a settling iteration stands for [s]: the longer, the more it heeds the rest posture of the arms, and
    the less their targets."""
    refining_time: float = Field(default=0.02, gt=0.0)
    """Time that a refining iteration stands for [s]: a control period, so that it ends where the episode goes on."""
    damping: float = Field(default=0.05, gt=0.0)
    """Damping of the pseudo-inverse [m]: joint motion is bounded by |Δx| / (2·damping) next to a singular posture."""
    reach: float = Field(default=0.2, ge=0.0)
    """Squared damping added per metre of error [m]: an arm stretched towards a target out of reach settles instead of
    overshooting."""
    longest_step: float = Field(default=0.1, gt=0.0)
    """Longest error that a step answers to [m]: a wrist turns towards a distant target without overshooting."""
    posture_gain: float = Field(default=1.0, ge=0.0)
    """Rate at which the redundant joints return to the rest posture [1/s]; slow, for the wrists come first."""
    gravity: bool = True
    """Offsets the arms' targets by the torques of their own weight and of the expected load, divided by the
    gains: without, wrists sag by 4 cm under the arms alone."""
    joint_speed: float | None = Field(default=None, gt=0.0)
    """Bound on the speed of the references [rad/s]; empty takes each joint's own limit from `robot.yaml`."""


class Recovery(Section):
    """Steps that catch the robot while no velocity is commanded: the gait clock runs while the base is felt to fall."""

    tilt: float = Field(default=0.25, gt=0.0)
    """Felt tilt from the pelvis of the reference posture at which the clock starts [rad]: pitch and roll where the
    gyroscope carries them within `horizon`. A quiet robot measures 0.1 in the median and 0.25 in one step of a hundred:
    up to 0.15 the clock runs most of the time. At 0.4 steps come too late for 20 N·s."""
    horizon: float = Field(default=0.25, ge=0.0)
    """Time over which the tilt goes on at the measured rate [s]: sqrt(h / g) of a pelvis at 0.7 m, so that the sum is
    the capture point's angle."""


class Placement(Section):
    """Feedback of the estimated forward speed on footholds: a robot that is pushed ahead steps further ahead, and one
    that stays behind pushes from further behind."""

    gain: float = Field(default=0.15, ge=0.0)
    """Way that a foot lands further ahead for each m/s above the commanded speed [s]. The capture point of a pendulum
    of 0.7 m is 0.27 s ahead, but the felt speed errs by as much as it varies, 0.15 m/s."""
    longest: float = Field(default=0.25, ge=0.0)
    """Longest such way [m]: about half of a leg's swing."""
    filter_time: float = Field(default=0.1, gt=0.0)
    """Time over which the last measurements before touch-down count [s]: joint velocities are noisy."""
    return_time: float = Field(default=0.27, gt=0.0)
    """Time constant with which a standing foot comes back to its place [s]: sqrt(h / g) of a pendulum of 0.7 m."""
    integral: float = Field(default=0.0, ge=0.0, json_schema_extra=LATER)
    """Way by which both feet trail further behind for each metre that the robot is felt to be behind its command, so
    that it leans into what it pushes [m/m]. Without, a crate of 10 kg moves at 1.18 and one of 60 kg at 0.56 of the
    commanded speed; with 0.05 at 1.07 and 0.74."""
    longest_trim: float = Field(default=0.1, ge=0.0, json_schema_extra=LATER)
    """Longest such way [m]: what 36 N in hands 0.95 m above the ground ask of 35 kg. With 0.16 policies that were not
    trained with it fall."""


class TorsoFeedback(Section):
    """Feedback of the torso's pitch on both hips, which hold up what the waist's motors cannot: they give 35 to 50 N·m,
    and 8 kg in the hands ask for 54 in a bow of 0.4 rad."""

    integral: float = Field(default=0.1, ge=0.0)
    """Turn of the hips for each radian by which the torso leans further than commanded, a second [1/s]. 0.3 costs a
    policy that was not trained with it a few lifts of 4 kg more."""
    furthest: float = Field(default=0.15, ge=0.0)
    """Furthest that the hips turn the pelvis back [rad]: a robot with 8 kg leans 0.2 further without."""
    least: float = Field(default=0.05, ge=0.0)
    """Furthest that they turn it ahead [rad]."""


class HeightFeedback(Section):
    """Feedback of the felt height on the legs, which stretch where robot and load bend the knees. Without, the pelvis
    of an expert hangs 2 cm lower than commanded with 4 kg, and 4 cm with 8 kg."""

    integral: float = Field(default=0.5, ge=0.0)
    """Stretch of both legs for each metre that the pelvis hangs lower than commanded, a second [1/s]."""
    furthest: float = Field(default=0.05, ge=0.0)
    """Longest such stretch, up or down [m]."""


class GaitPrior(Section):
    """The gait clock, and the stride that it adds to the support reference while a velocity is commanded."""

    enabled: bool = True
    """Off gives the paper's literal reference; the clock still runs."""
    frequency: float = Field(default=1.35, gt=0.0)
    """Strides a second [Hz]."""
    stance: float = Field(default=0.58, gt=0.5, lt=1.0)
    """Part of the stride in which a foot is on the ground; above one half both are, twice a stride."""
    stride: float = Field(default=1.0, ge=0.0)
    """Part of the commanded velocity and yaw rate at which standing feet travel under the pelvis: at 1 the reference
    walks as commanded and the policy only corrects it, at 0 it steps in place."""
    swing_clearance: float = Field(default=0.08, gt=0.0)
    """Height of the sole at mid-swing [m]; the reward's profile is this one, too."""
    profile: Literal["sine", "rest"] = Field(default="sine", json_schema_extra=LATER)
    """Height over the swing: clearance·sin(π·progress), which lands at 0.81 m/s, or clearance·sin²(π·progress), which
    lifts off and lands at rest."""
    sway: float = Field(default=0.02, ge=0.0)
    """Amplitude of the pelvis' motion over the standing foot [m]. A pendulum of 0.7 m that steps every 0.37 s from side
    to side between feet 0.24 m apart sways by 0.022 m."""
    spread: float = Field(default=0.0, ge=0.0, le=0.1, json_schema_extra=LATER)
    """Distance by which each foot is further to its side than in the support posture, standing and walking [m].
    `compliant_quick` survives 215 of 240 disturbed trials with 0.04 and 200 without, but pushes 60 kg at two thirds of
    the pace."""
    straightest_knee: float = Field(default=0.1, gt=0.0)
    """Bend of the knee from the straight leg at which a stride ends that reaches further [rad]; nearer to the straight
    leg, millimetres of reach are tenths of a radian."""
    moving_speed: float = Field(default=0.05, gt=0.0)
    """Commanded planar speed above which the clock runs [m/s]."""
    moving_yaw_rate: float = Field(default=0.1, gt=0.0)
    """Commanded yaw rate above which the clock runs [rad/s]."""
    recovery: Recovery | None = Field(default=None, json_schema_extra=LATER)
    """Steps while standing, after a push; empty leaves the clock to the command alone."""
    placement: Placement | None = Field(default=None, json_schema_extra=LATER)
    """Feedback of the estimated forward speed on footholds; empty leaves them to the policy."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.placement is not None and not self.enabled:
            yield "", "placement: moves the feet of the gait prior, which is off (`enabled: false`); empty it"


class References(Section):
    """The reference generation layer of the control loop."""

    use_rg: bool = True
    """Takes θ_S_ref from the reference generator; otherwise it is the constant default posture ("w/o RG")."""
    grasps: Grasps = Grasps()
    """Base grasp of each scene."""
    lean: float = Field(default=0.3, ge=0.0)
    """Way that grasps move ahead as the torso leans by a right angle [m], in proportion to the sine: as far as the
    chest at the height of the object's upper edge, so that the torso does not come to lie on it."""
    loads: Loads = Loads()
    """Loads that the arms expect to carry in each scene."""
    largest_pitch: float | None = Field(default=None, gt=0.0, le=1.6, json_schema_extra=LATER)
    """Torso pitch at which commands are clamped, before the feasible map ends [rad]. The map holds what has a support
    posture in equilibrium; a policy may hold less. Empty clamps to the map alone."""
    upright: bool = Field(default=False, json_schema_extra=LATER)
    """Whether the references leave out commanded height and pitch: for a controller that takes velocities alone, whose
    arms would else reach to where its torso does not go."""
    arms: ArmReference = ArmReference()
    """Arm references."""
    gait: GaitPrior = GaitPrior()
    """Gait clock and swing."""
    torso: TorsoFeedback | None = Field(default=None, json_schema_extra=LATER)
    """Hips that hold up the torso; empty leaves it to the policy."""
    height: HeightFeedback | None = Field(default=None, json_schema_extra=LATER)
    """Legs that hold up the pelvis; empty leaves it to the policy."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.height is not None and not self.gait.enabled:
            yield "", "height: stretches the legs of the gait prior, which is off (`gait.enabled: false`); empty it"
        for name, grasp in self.grasps:
            if grasp[1] <= 0.0:
                text = f"the left wrist's y is {grasp[1]}, it must be positive (left of the body)"
                yield "", f"grasps.{name}: {text}"
