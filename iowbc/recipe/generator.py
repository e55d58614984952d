"""The reference generator: its dataset and its network."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from iowbc.recipe.section import DEEPEST, LATER, Interval, NonNegative, Positive, Section, Width

Share = Annotated[float, Field(ge=0, le=1)]


class WristRegion(Section):
    """Places of the wrists: a box for the left wrist; the right one is mirrored and moved by the asymmetry."""

    x: Interval = Interval(low=0.14, high=0.46)
    """Forward of the frame's origin [m]."""
    y: Interval = Interval(low=0.06, high=0.34)
    """To the left of the sagittal plane [m]; for the right wrist to the right."""
    z: Interval = Interval(low=-0.15, high=0.40)
    """Above the frame's origin [m]."""
    asymmetry: NonNegative = 0.10
    """Largest shift of each coordinate between the left and the mirrored right wrist [m]."""
    redundancy: NonNegative = 0.25
    """Largest random shift of each arm joint [rad] before inverse kinematics, so that elbows and wrists vary too."""


class Sampling(Section):
    """Arm postures and base commands that are labelled: a scrambled Sobol sequence with edges and nominal points."""

    samples: int = Field(default=60000, ge=16, le=2_000_000)
    """Points tried; about six in ten get a label (three have arms in collision, one is out of the robot's reach)."""
    height: Interval = Interval(low=0.5, high=0.8)
    """Commanded height [m]."""
    pitch: Interval = Interval(low=-0.5, high=1.5)
    """Commanded torso pitch [rad], positive leaning forward."""
    heading_share: Share = 0.5
    """Share of the arms put by inverse kinematics at wrist positions in the heading frame, as wrist commands do."""
    torso_share: Share = 0.35
    """Share put at wrist positions in the torso frame, as when a load leans with the trunk; the rest is uniform."""
    wrists: WristRegion = WristRegion()
    """Places of those wrists."""
    joint_ranges: dict[str, Interval] = Field(default={})
    """Narrower ranges [rad] of arm joints in the uniform share, e.g. `left_elbow_joint: {low: 0, high: 1}`."""
    boundary_share: Share = 0.06
    """Share of the samples moved onto the edge of the command ranges, so that nothing is extrapolated there."""
    nominal_share: Share = 0.03
    """Share of the samples with the arms at the default posture."""
    mirrored_share: Share = 0.05
    """Share of the samples that repeat another one mirrored left to right: they measure the labels' symmetry."""

    def problems(self) -> Iterator[tuple[str, str]]:
        if self.heading_share + self.torso_share > 1.0:
            yield "", "heading_share and torso_share together pass 1"


class PostureProblem(Section):
    """The cost (paper eq. 4) and the physical limits, the same for both methods. Costs are ½·weight·residual²."""

    com_weight: Positive = 1e3
    """Horizontal distance of the centre of mass from the middle of the soles [1/m²]."""
    height_weight: Positive = 1e4
    """Height error [1/m²]."""
    torso_weight: Positive = 1e3
    """Torso orientation error [1/rad²]."""
    torque_weight: Positive = 1e-3
    """Joint torques [1/(N·m)²]."""
    sagittal_weight: Positive = 0.1
    """Leg joints about the lateral axis (pitch, knee) against the default posture [1/rad²]."""
    lateral_weight: Positive = 5.0
    """Leg joints about other axes (roll, yaw) against the default posture [1/rad²]."""
    waist_weight: Positive = 5.0
    """Waist joints [1/rad²]. Without it hips and waist share the pitch arbitrarily, and the optimum jumps."""
    waist_share: Share = Field(default=0.0, json_schema_extra=LATER)
    """Part of the commanded torso pitch that the waist is drawn to, as far as it turns; hips take the rest. At 1 the
    pelvis stays level up to a bow of 0.5 rad, as the gait has it, and a load that the waist's motors cannot hold
    there sinks no further than the joint's stop."""
    friction: Positive = 0.6
    """Friction coefficient of the soles that a label may use; the simulation draws 0.5 to 1.2."""
    sole_fraction: Annotated[float, Field(gt=0, le=1)] = 0.9
    """Part of the sole's rectangle within which the centre of pressure stays."""
    smallest_load: NonNegative = 20.0
    """Least normal force on each foot [N]."""
    limit_margin: NonNegative = 0.02
    """Distance kept from joint limits [rad]."""
    effort_fraction: Annotated[float, Field(gt=0, le=1)] = 0.95
    """Part of the torque limits that a label may use."""
    stance_width: Positive = 0.237
    """Distance between the sole centres [m]: hip to hip, so that the default posture has straight hips."""
    iterations: int = Field(default=40, ge=1, le=10_000)
    """Most Gauss-Newton steps of the static method."""
    tolerance: Positive = 1e-4
    """The static method ends when no joint moves by more than this in a step [rad]."""
    largest_step: Positive = 0.5
    """Largest move of a joint in a Gauss-Newton step [rad]."""


class OptimalControl(Section):
    """The multi-contact optimal control problem over a horizon, solved by BoxFDDP with the arms locked."""

    nodes: int = Field(default=20, ge=4, le=1000)
    """Intervals of the horizon."""
    step: Positive = 0.05
    """Length of an interval [s]."""
    iterations: int = Field(default=60, ge=1, le=10_000)
    """Most solver iterations."""
    label_at: Annotated[float, Field(gt=0, lt=1)] = 0.7
    """Fraction of the horizon whose node is the label: the terminal node is biased by the terminal cost."""
    velocity_weight: Positive = 0.03
    """Joint and base velocities [s²/rad²]. Postures that cost nearly as little as the optimum are left with a time
    constant of 0.2 s at 0.03, 0.3 s at 0.1."""
    terminal_factor: Positive = 0.05
    """Terminal weights over running weights, which count for each second: 0.05 is one more interval. At 10 the missing
    torques at the end bend the flattest postures by 0.25 rad, and by 0.1 at the label's node."""
    terminal_velocity_weight: Positive = 1e2
    """Velocities at the end of the horizon [s²/rad²]."""
    limit_weight: Positive = 1e3
    """Quadratic barrier outside the joint limits [1/rad²]."""
    cone_weight: Positive = 10.0
    """Quadratic barrier outside friction and centre of pressure [1/N²]."""
    contact_gains: tuple[NonNegative, NonNegative] = (100.0, 20.0)
    """Stabilisation of the feet: position [1/s²], velocity [1/s]. Without the first the feet drift by centimetres."""
    settled: Positive = 0.02
    """Largest norm of the velocity at the end of the horizon [rad/s and m/s]."""


class LabelGates(Section):
    """Gates of a label, whatever its method; a sample that misses one is rejected with that reason."""

    foot_position: Positive = 0.002
    """Distance of each sole centre from its place [m]."""
    foot_rotation: Positive = 0.002
    """Rotation of each sole from its place [rad]."""
    height: Positive = 0.01
    """Error of the commanded height [m]."""
    orientation: Positive = 0.03
    """Error of the commanded torso orientation [rad]."""
    equilibrium: Positive = 0.5
    """Force [N] or moment [N·m] left over on the base."""
    wrench: NonNegative = 0.5
    """Violation of friction or centre-of-pressure limits [N]."""
    support_margin: float = 0.02
    """Least distance of the projected centre of mass inside the support polygon [m]."""
    collision_clearance: float = 0.0
    """Least distance between the capsules of links that may touch [m]."""


class CrossCheck(Section):
    """Static labels held against the optimal control problem."""

    samples: int = Field(default=300, ge=0, le=2_000_000)
    """Labels that are solved again by optimal control; 0 leaves the check out. Without effect for `method: ocp`."""
    p90_limit: Positive = 0.02
    """The stage fails when one sample in ten differs by more in some joint [rad]."""


class FeasibleRegion(Section):
    """The map of (height, pitch) that have a label, to which commands are clamped."""

    heights: int = Field(default=31, ge=3, le=1000)
    """Grid points over the height range, labelled with two arm postures."""
    pitches: int = Field(default=41, ge=3, le=1000)
    """Grid points over the pitch range."""
    jump: Positive = 0.055
    """Largest move of a joint for one step of height or pitch (`fit.smoothness`) that the network makes in the map
    [rad]: near straight legs and at joint limits the reference leaps."""
    gentle_share: Share = 0.98
    """Share of the arm postures for which that must hold at a command."""
    arms: int = Field(default=200, ge=1, le=100_000)
    """Arm postures of the dataset on which that is judged."""
    bound_slope: Positive = 1.0
    """Steepest change of the map's bounds with pitch [m/rad]: a clamped height does not leap when the pitch moves."""
    kept_share: Share = 0.5
    """A command needs this share of the samples around it, with any arms, to have a label."""
    window: tuple[Positive, Positive] = (0.02, 0.1)
    """Samples around a command: those within this height [m] and pitch [rad]."""
    enough: int = Field(default=20, ge=1, le=100_000)
    """Samples that there must be for their share to count; fewer leave it to the two arm postures of the grid."""


class FitGates(Section):
    """Gates of the network on held-out samples. `null` leaves a gate out."""

    joint_rmse: Positive | None = 0.016
    """Root mean square error of the joints [rad]."""
    height_p95: Positive | None = 0.003
    """95th percentile of the height error [m], through forward kinematics."""
    pitch_p95: Positive | None = 0.01
    """95th percentile of the torso pitch error [rad], against the soles."""
    foot_p95: Positive | None = 0.0015
    """95th percentile of the distance of each sole centre from its place [m], both soles fitted together."""
    margin_p1: float | None = 0.04
    """1st percentile of the distance of the centre of mass inside the support polygon [m]."""
    jump: Positive | None = 0.05
    """Largest move of a joint for one small step of the command [rad]."""


class SmoothnessCheck(Section):
    """Measurement of the network's smoothness: random lines through the feasible map, walked in small steps."""

    lines: int = Field(default=1000, ge=1, le=1_000_000)
    """Random lines."""
    height_step: Positive = 0.005
    """Step of the height [m]."""
    pitch_step: Positive = 0.02
    """Step of the pitch [rad]."""


class Fit(Section):
    """The network φ_RG and its training."""

    hidden: tuple[Width, ...] = Field(default=(128, 64), min_length=1, max_length=DEEPEST)
    """Widths of the hidden layers (paper's order of size), ELU."""
    held_out: Annotated[float, Field(gt=0, lt=1)] = 0.1
    """Share of the samples kept for the gates; a sample and its mirror image are on the same side."""
    validation: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """Share kept for early stopping, apart from the gates'."""
    mirror: bool = True
    """Train on the left-right mirror image of each sample as well."""
    epochs: int = Field(default=150, ge=1, le=1_000_000)
    """Most passes over the training samples."""
    batch: int = Field(default=256, ge=1, le=2_000_000)
    """Samples in a gradient step."""
    learning_rate: Positive = 5e-3
    """Adam's first learning rate; it falls to a hundredth along a cosine."""
    patience: int = Field(default=40, ge=1, le=1_000_000)
    """Epochs without a better validation loss before training ends."""
    task_weight: NonNegative = 4.0
    """Weight of the errors in feet, height and torso orientation beside the joints, in the units of `length_scale`."""
    length_scale: Positive = 0.1
    """Length [m] that weighs as much as one radian in that loss."""
    gates: FitGates = FitGates()
    """Limits on held-out data."""
    smoothness: SmoothnessCheck = SmoothnessCheck()
    """Measurement of smoothness."""


class ReferenceGenerator(Section):
    """The reference generator: its dataset and its network."""

    method: Literal["static", "ocp"] = "static"
    """Method of labelling: `ocp` is the optimal control problem, `static` its steady state (15 times faster)."""
    height: Literal["pelvis", "com"] = "pelvis"
    """Meaning of the commanded height: the pelvis (0.5 to 0.8 m on the G1), or the centre of mass as the paper
    writes."""
    sampling: Sampling = Sampling()
    """Arms and commands that are labelled."""
    problem: PostureProblem = PostureProblem()
    """Costs and physical limits."""
    ocp: OptimalControl = OptimalControl()
    """The optimal control problem over a horizon."""
    gates: LabelGates = LabelGates()
    """Gates of each label."""
    crosscheck: CrossCheck = CrossCheck()
    """Static labels against optimal control."""
    feasible: FeasibleRegion = FeasibleRegion()
    """The feasible map."""
    fit: Fit = Fit()
    """The network."""
