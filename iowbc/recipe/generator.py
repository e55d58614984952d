"""The reference generator: its dataset and its network."""

from typing import Annotated, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from iowbc.recipe.section import LATER, HiddenLayers, Interval, Problems, Section, Share


class WristRegion(Section):
    """Region of wrist positions: a box for the left wrist; the right one is mirrored and shifted by the asymmetry."""

    x: Interval = Interval(low=0.14, high=0.46)
    """Forward of the frame's origin [m]."""
    y: Interval = Interval(low=0.06, high=0.34)
    """To the left of the sagittal plane [m]; for the right wrist to the right."""
    z: Interval = Interval(low=-0.15, high=0.40)
    """Above the frame's origin [m]."""
    asymmetry: NonNegativeFloat = 0.10
    """Largest shift of each coordinate between the left and the mirrored right wrist [m]."""
    redundancy: NonNegativeFloat = 0.25
    """Largest random shift of each arm joint [rad] before inverse kinematics, so that elbows and wrists vary too."""


class Sampling(Section):
    """Sampling of arm postures and base commands to label: a scrambled Sobol sequence with edge and nominal points."""

    samples: int = Field(default=60000, ge=16, le=2_000_000)
    """Number of candidates; about six in ten get a label (three have arms in collision, one is out of reach)."""
    height: Interval = Interval(low=0.5, high=0.8)
    """Commanded height [m]."""
    pitch: Interval = Interval(low=-0.5, high=1.5)
    """Commanded torso pitch [rad], positive leaning forward."""
    heading_share: Share = 0.5
    """Fraction of the arm postures from inverse kinematics of wrists in the heading frame, like wrist commands."""
    torso_share: Share = 0.35
    """Fraction from wrist positions in the torso frame, as when a load leans with the trunk; the rest is uniform."""
    wrists: WristRegion = WristRegion()
    joint_ranges: dict[str, Interval] = Field(default={})
    """Narrower ranges [rad] of arm joints for the uniform postures, e.g. `left_elbow_joint: {low: 0, high: 1}`."""
    boundary_share: Share = 0.06
    """Fraction of the samples moved onto the edge of the command ranges, to avoid extrapolation there."""
    nominal_share: Share = 0.03
    """Fraction of the samples with the arms at the default posture."""
    mirrored_share: float = Field(default=0.05, ge=0.0, le=0.5)
    """Fraction of the samples that mirror another one left to right, to measure the labels' symmetry."""

    def problems(self) -> Problems:
        if self.heading_share + self.torso_share > 1.0:
            yield "", "heading_share and torso_share together pass 1"


class PostureProblem(Section):
    """Cost (paper eq. 4) and physical limits of both methods. Costs are ½·weight·residual²."""

    com_weight: PositiveFloat = 1e3
    """Horizontal distance of the centre of mass from the middle of the soles [1/m²]."""
    height_weight: PositiveFloat = 1e4
    """Height error [1/m²]."""
    torso_weight: PositiveFloat = 1e3
    """Torso orientation error [1/rad²]."""
    torque_weight: PositiveFloat = 1e-3
    """Joint torques [1/(N·m)²]."""
    sagittal_weight: PositiveFloat = 0.1
    """Leg joints about the lateral axis (pitch, knee) against the default posture [1/rad²]."""
    lateral_weight: PositiveFloat = 5.0
    """Leg joints about other axes (roll, yaw) against the default posture [1/rad²]."""
    waist_weight: PositiveFloat = 5.0
    """Waist joints [1/rad²]. Without it hips and waist share the pitch arbitrarily, and the optimum jumps."""
    waist_share: Share = Field(default=0.0, json_schema_extra=LATER)
    """Fraction of the commanded torso pitch that is the waist's target, within its range; hips take the rest. At 1 the
    pelvis stays level up to a bow of 0.5 rad, as in the gait, and the joint's stop bears loads that exceed the waist's
    motors."""
    friction: PositiveFloat = 0.6
    """Friction coefficient of the soles for labels; the simulation draws 0.5 to 1.2."""
    sole_fraction: Annotated[float, Field(gt=0, le=1)] = 0.9
    """Fraction of the sole's rectangle within which the centre of pressure stays."""
    smallest_load: NonNegativeFloat = 20.0
    """Smallest normal force on each foot [N]."""
    limit_margin: NonNegativeFloat = 0.02
    """Distance kept from joint limits [rad]."""
    effort_fraction: Annotated[float, Field(gt=0, le=1)] = 0.95
    """Fraction of the torque limits that a label may use."""
    stance_width: PositiveFloat = 0.237
    """Distance between the sole centres [m]: hip to hip, so that the default posture has straight hips."""
    iterations: int = Field(default=40, ge=1, le=10_000)
    """Largest number of Gauss-Newton steps of the static method."""
    tolerance: PositiveFloat = 1e-4
    """Convergence tolerance of the static method: largest joint motion of a step [rad]."""
    largest_step: PositiveFloat = 0.5
    """Largest move of a joint in a Gauss-Newton step [rad]."""


class OptimalControl(Section):
    """The multi-contact optimal control problem over a horizon, solved by BoxFDDP with the arms locked."""

    nodes: int = Field(default=20, ge=4, le=1000)
    """Intervals of the horizon."""
    step: PositiveFloat = 0.05
    """Length of an interval [s]."""
    iterations: int = Field(default=60, ge=1, le=10_000)
    """Largest number of solver iterations."""
    label_at: Annotated[float, Field(gt=0, lt=1)] = 0.7
    """Fraction of the horizon whose node is the label: the terminal node is biased by the terminal cost."""
    velocity_weight: PositiveFloat = 0.03
    """Joint and base velocities [s²/rad²]. Along flat directions of the cost, postures converge with a time
    constant of 0.2 s at 0.03, and 0.3 s at 0.1."""
    terminal_factor: PositiveFloat = 0.05
    """Ratio of terminal to running weights; the latter are per second, so that 0.05 equals one more interval. At 10,
    the absence of torques at the end bends the postures of flattest cost by 0.25 rad, and by 0.1 at the label's
    node."""
    terminal_velocity_weight: PositiveFloat = 1e2
    """Velocities at the end of the horizon [s²/rad²]."""
    limit_weight: PositiveFloat = 1e3
    """Quadratic barrier outside the joint limits [1/rad²]."""
    cone_weight: PositiveFloat = 10.0
    """Quadratic barrier outside friction and centre of pressure [1/N²]."""
    contact_gains: tuple[NonNegativeFloat, NonNegativeFloat] = (100.0, 20.0)
    """Stabilisation of the feet: position [1/s²], velocity [1/s]. Without the first the feet drift by centimetres."""
    settled: PositiveFloat = 0.02
    """Largest norm of the velocity at the end of the horizon [rad/s and m/s]."""


class LabelGates(Section):
    """Acceptance limits of a label by either method; a sample beyond a limit is rejected with that reason."""

    foot_position: PositiveFloat = 0.002
    """Distance of each sole centre from its place [m]."""
    foot_rotation: PositiveFloat = 0.002
    """Rotation of each sole from its place [rad]."""
    height: PositiveFloat = 0.01
    """Error of the commanded height [m]."""
    orientation: PositiveFloat = 0.03
    """Error of the commanded torso orientation [rad]."""
    equilibrium: PositiveFloat = 0.5
    """Residual force [N] or moment [N·m] on the base."""
    wrench: NonNegativeFloat = 0.5
    """Violation of friction or centre-of-pressure limits [N]."""
    support_margin: float = 0.02
    """Smallest distance of the projected centre of mass inside the support polygon [m]."""
    collision_clearance: float = 0.0
    """Smallest distance between the capsules of links that may touch [m]."""


class CrossCheck(Section):
    """Comparison of static labels with the optimal control problem."""

    samples: int = Field(default=300, ge=0, le=2_000_000)
    """Labels solved again by optimal control; 0: no check. Without effect for `method: ocp`."""
    p90_limit: PositiveFloat = 0.02
    """Limit on the 90th percentile of the largest joint difference of a sample [rad]; beyond it, the stage fails."""


class FeasibleRegion(Section):
    """The map of (height, pitch) that have a label, to which commands are clamped."""

    heights: int = Field(default=31, ge=3, le=1000)
    """Grid points over the height range, labelled with two arm postures."""
    pitches: int = Field(default=41, ge=3, le=1000)
    """Grid points over the pitch range."""
    jump: PositiveFloat = 0.055
    """Largest joint motion of the network per step of height or pitch (`fit.smoothness`) in the map [rad]. It excludes
    commands near straight legs and joint limits, where the reference jumps."""
    gentle_share: Share = 0.98
    """Fraction of the arm postures for which `jump` must hold at a command."""
    arms: int = Field(default=200, ge=1, le=100_000)
    """Number of arm postures of the dataset on which `jump` is tested."""
    bound_slope: PositiveFloat = 1.0
    """Largest slope of the map's bounds over pitch [m/rad], so that a clamped height does not jump as pitch changes."""
    kept_share: Share = 0.5
    """Smallest fraction of the samples around a feasible command, with any arm posture, that have a label."""
    window: tuple[PositiveFloat, PositiveFloat] = (0.02, 0.1)
    """Half-widths in height [m] and pitch [rad] of the samples around a command."""
    enough: int = Field(default=20, ge=1, le=100_000)
    """Smallest number of samples for `kept_share` to apply; with fewer, the two arm postures of the grid decide."""


class FitGates(Section):
    """Acceptance limits of the network on held-out samples. `null` disables a limit."""

    joint_rmse: PositiveFloat | None = 0.016
    """Root mean square error of the joints [rad]."""
    height_p95: PositiveFloat | None = 0.003
    """95th percentile of the height error [m], through forward kinematics."""
    pitch_p95: PositiveFloat | None = 0.01
    """95th percentile of the torso pitch error [rad], against the soles."""
    foot_p95: PositiveFloat | None = 0.0015
    """95th percentile of the distance of each sole centre from its place [m], both soles fitted together."""
    margin_p1: float | None = 0.04
    """1st percentile of the distance of the centre of mass inside the support polygon [m]."""
    jump: PositiveFloat | None = 0.05
    """Largest joint motion for one small step of the command [rad]."""


class SmoothnessCheck(Section):
    """Measurement of the network's smoothness: random lines through the feasible map, walked in small steps."""

    lines: int = Field(default=1000, ge=1, le=1_000_000)
    """Random lines."""
    height_step: PositiveFloat = 0.005
    """Step of the height [m]."""
    pitch_step: PositiveFloat = 0.02
    """Step of the pitch [rad]."""


class Fit(Section):
    """The network φ_RG and its training."""

    hidden: HiddenLayers = Field(default=(128, 64), min_length=1)
    """Widths of the hidden layers (paper's order of size), ELU."""
    held_out: Annotated[float, Field(gt=0, lt=1)] = 0.1
    """Fraction of the samples held out for the gates; a sample and its mirror image are on the same side."""
    validation: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """Fraction held out for early stopping, distinct from that for the gates."""
    mirror: bool = True
    """Train on the left-right mirror image of each sample as well."""
    epochs: int = Field(default=150, ge=1, le=1_000_000)
    """Largest number of passes over the training samples."""
    batch: int = Field(default=256, ge=1, le=2_000_000)
    """Batch size."""
    learning_rate: PositiveFloat = 5e-3
    """Initial learning rate of Adam; a cosine schedule reduces it to a hundredth."""
    patience: int = Field(default=40, ge=1, le=1_000_000)
    """Epochs without a better validation loss before training ends."""
    task_weight: NonNegativeFloat = 4.0
    """Weight of the errors in feet, height and torso orientation relative to the joints, in units of `length_scale`."""
    length_scale: PositiveFloat = 0.1
    """Length [m] that weighs as much as one radian in that loss."""
    gates: FitGates = FitGates()
    smoothness: SmoothnessCheck = SmoothnessCheck()


class ReferenceGenerator(Section):
    """The reference generator: its dataset and its network."""

    method: Literal["static", "ocp"] = "static"
    """Method of labelling: `ocp` is the optimal control problem, `static` its steady state (8 times faster)."""
    height: Literal["pelvis", "com"] = "pelvis"
    """Meaning of the commanded height: the pelvis (0.5 to 0.8 m on the G1), or the centre of mass (paper)."""
    sampling: Sampling = Sampling()
    problem: PostureProblem = PostureProblem()
    ocp: OptimalControl = OptimalControl()
    gates: LabelGates = LabelGates()
    crosscheck: CrossCheck = CrossCheck()
    feasible: FeasibleRegion = FeasibleRegion()
    fit: Fit = Fit()
