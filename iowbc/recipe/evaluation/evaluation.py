"""Settings of the evaluation: suites of trials, their simulation, success criteria and videos."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import Field

from iowbc.recipe.evaluation.baselines import ModelBased, PublicController
from iowbc.recipe.evaluation.sequences import DrawnScripts, Segment
from iowbc.recipe.evaluation.suites import Compliance, HeavyCase, MassSweep, Probe, PushMap, Robustness, Stagnation
from iowbc.recipe.section import COSMETIC, LATER, CustomName, Problems, Section, Vector
from iowbc.recipe.simulation.scene import Object, Scene
from iowbc.recipe.simulation.simulation import SimulationSettings


class Drake(Section):
    """Integration by Drake; masses, gains, friction and all randomization are those of `simulation`."""

    timestep: float = Field(default=0.004, gt=0.0, le=0.02)
    """Physics step [s]; the control period must be a multiple of it. Most trials have the same outcome at 2 ms."""
    contact: Literal["sap", "lagged", "similar"] = "lagged"
    """Contact approximation of the SAP solver: linear damping (`sap`) or Hunt-Crossley damping (`lagged`, `similar`).
    With all but `lagged`, a sliding contact also pushes the bodies apart."""
    ground_stiffness: float = Field(default=2e5, gt=0.0)
    """Stiffness of a contact point of the soles [N/m]. On eight points the robot sinks 0.2 mm, as in MuJoCo."""
    body_stiffness: float = Field(default=1e4, gt=0.0)
    """Stiffness of contacts of the object with palms and links, and between links [N/m]. An 8 kg box that hits a thigh
    is stopped with the force of MuJoCo's contact, whose time constant is 20 ms. At ten times this stiffness, the
    impact tears the box out of the hands."""
    relaxation: float = Field(default=0.02, ge=0.0)
    """Time constant of the linear contact damping [s]; MuJoCo's value."""
    dissipation: float = Field(default=2.0, ge=0.0)
    """Hunt-Crossley dissipation of a contact [s/m]."""
    stiction: float = Field(default=1e-3, gt=0.0)
    """Speed below which friction is regularized, for sliding contacts and crates [m/s] and for joints [rad/s]. At its
    friction limit a crate at rest creeps at this speed, as in MuJoCo."""


class Success(Section):
    """Success criteria of a trial. Survival: neither a fall nor a dropped object, by `task.termination`, for the whole
    trial. Success: survival and transport of an object that the hands carry or keep; with a partner, also bounded
    force. An infeasible push instead requires survival, posture, feet that do not slide, and continued pushing. A
    robot that stands still never succeeds where a distance is commanded."""

    withdrawn_from_key: ClassVar[Mapping[str, Any]] = {"slip_fails": False}

    transport: float = Field(default=0.5, ge=0, le=1)
    """Fraction of the commanded displacement that robot and object must cover; a stationary robot covers none."""
    weight_in_hands: float = Field(default=0.95, ge=0, le=1)
    """Fraction of a held object's weight, less all external vertical forces, that must rest in the hands on average;
    the rest lies on thighs or torso."""
    least_weight: float = Field(default=5.0, ge=0)
    """Weight, less the partner's nominal share, below which `weight_in_hands` is not evaluated [N]. A 0.05 kg box
    weighs a tenth of this, and a touch of the torso is several times its weight."""
    object_beside: float = Field(default=0.35, gt=0, json_schema_extra=LATER)
    """Lateral distance from the robot beyond which a pushed object counts as lost [m]: the midpoint of the hands is
    then past the edge of a 0.6 m wide crate. For a held object see `object_distance`."""
    push_force: float = Field(default=0.5, ge=0, le=1)
    """Fraction of the largest possible push that counts as pushing, for success in an infeasible push. The largest
    possible push is μ times the vertical ground force on both feet, or the crate's rolling resistance if that is
    smaller; both forces are averaged over a gait period."""
    push_time: float = Field(default=0.5, ge=0, le=1)
    """Fraction of the time with commanded steps in which the robot must push with `push_force`."""
    foot_slide: float = Field(default=0.1, gt=0)
    """Largest mean sliding speed of the loaded soles, both feet together, for success in an infeasible push [m/s];
    twice that of walking."""
    handle_force: float = Field(default=50.0, gt=0)
    """Largest 95th percentile of the horizontal force between partner and object for success in a compliance trial
    [N]. It is slightly above the 40 N of a firm one-arm pull, and well below the 80 N at which the partner's own arms
    yield."""
    hand_force: float = Field(default=90.0, gt=0)
    """Largest 95th percentile of the horizontal force at either hand for success in a compliance trial with a blocked
    crate [N]. Both hands then push with 180 N at most: half of what the highest friction in training (1.2) allows."""
    least_push: float = Field(default=20.0, ge=0)
    """Smallest mean force of both hands while steps are commanded, for success in a compliance trial with a blocked
    crate [N]. It excludes robots that do not push at all."""
    compliance_transport: float = Field(default=0.25, ge=0, le=1)
    """Fraction of the commanded displacement that robot and object must cover in a compliance trial: half of
    `transport`, because the partner stops, lags and deviates."""
    posture_pitch: float = Field(default=0.3, gt=0)
    """Largest mean torso pitch error for success in an infeasible push [rad]; twice the paper's E_α."""
    posture_height: float = Field(default=0.05, gt=0)
    """Largest mean height error for success in an infeasible push [m]; 2.5 times the paper's E_h."""
    capacity_rate: float = Field(default=0.8, gt=0, le=1, json_schema_extra=COSMETIC)
    """Success rate that a mass and all lighter ones must reach to count towards the load capacity."""


class Video(Section):
    """Videos of trials."""

    count: int = Field(default=2, ge=0, le=1000)
    """Number of videos, spread over the sweeps' masses; 0 for none."""
    width: int = Field(default=640, ge=64, le=1920, multiple_of=16)
    """Width of a frame [pixel]; video codecs require multiples of 16."""
    height: int = Field(default=480, ge=64, le=1088, multiple_of=16)
    """Height of a frame [pixel]."""
    fps: int = Field(default=20, ge=1, le=50)
    """Frames per second; rendering a frame takes 0.1 to 0.2 s without a GPU."""
    duration: float = Field(default=12.0, gt=0)
    """Largest duration of a video [s]."""
    traces: bool = True
    """Overlay scene, mass, time and command on the frames."""


class TrialScene(Section):
    """Additional scene for evaluation. It does not change the layout of the policy's observation."""

    scene: Scene
    """The object and how it is held; it may also replace a training scene."""
    wrists: Vector
    """Base grasp: left wrist relative to the pelvis, heading frame [m]; as in `task.references.grasps`."""
    load: float | None = Field(default=0.0, ge=0.0)
    """Load that the arm references compensate [kg], as in `task.references.loads`; empty: that of `lift`."""


BESIDE = 0.035
"""Distance of a wrist from the side of the box in its hands [m], in the scene `lift`."""


def box(width: float) -> TrialScene:
    """The scene `lift` with a box of another width [m]."""
    thing = Object(shape="box", size=(0.30, width, 0.30), mass=7.0)
    return TrialScene(scene=Scene(kind="lift", object=thing), wrists=(0.30, width / 2 + BESIDE, 0.26), load=None)


SIZES = {"narrow_box": box(0.2), "wide_box": box(0.45)}
"""Boxes beyond the training's 0.25 m."""


class Evaluation(Section):
    """Trials of the trained policy."""

    policy: Literal["student", "teacher", "model", "public"] = "student"
    """The acting policy: the deployable student, the teacher with its privileged observation, the model-based
    controller of `model` (no training), or the third-party controller of `public`."""
    model: ModelBased = Field(default=ModelBased(), json_schema_extra=LATER)
    public: PublicController | None = Field(default=None, json_schema_extra=LATER)
    """A third-party controller, for the policy `public`."""
    label: str = Field(default="IO-WBC", min_length=1, max_length=200, json_schema_extra=COSMETIC)
    """Name of the variant in tables and figures; the paper's are IO-WBC, WBC, w/o RG, w/o Distill."""
    trials: int = Field(default=5, ge=1, le=10_000)
    """Trials per mass; trial k of every mass and variant has the same seed, and the same drawn script."""
    split: Literal["test", "development"] = "test"
    """Seed range of the trials. `test`: for reported results only, never for selection. `development`: for choosing
    between trainings; `teacher.check` uses it too. The two ranges are disjoint."""
    seed: int = Field(default=1000, ge=0, lt=2**32)
    """Seed of the first trial, within its split."""
    sequence: tuple[Segment, ...] = ()
    """Default command sequence of sweeps and cases; the durations add up to that of the trial. Empty: `scripts`."""
    scripts: DrawnScripts | None = None
    """Random command scripts, drawn per trial, for sweeps and cases without a sequence. Empty: the fixed sequence of
    lifting or pushing."""
    simulation: SimulationSettings | None = None
    """Simulation settings of all trials; empty: those of training. Set it (`{}` for the default) to evaluate variants
    that were trained under different settings in the same trials."""
    scenes: dict[CustomName, TrialScene] = Field(default=SIZES)
    """Additional scenes by name: other objects, sizes and grasps for an already trained policy."""
    batch: int = Field(default=64, ge=1, le=10_000)
    """Trials simulated at once, over all workers. The policy always computes whole batches of this size, so that a
    trial repeated alone is identical bit for bit; another size rounds differently."""
    foot_load: float = Field(default=50.0, gt=0)
    """Smallest vertical force on a foot that counts as loaded when its sliding is measured [N]; 15 % of the weight."""
    lifting: MassSweep | None = MassSweep()
    """Masses lifted (paper's Table II); empty: no sweep."""
    pushing: MassSweep | None = None
    """Masses pushed against a rolling resistance (paper's Table III); empty: no sweep."""
    squeezing: MassSweep | None = None
    """Masses held between the palms by friction alone, in a scene such as `squeeze`; empty: no sweep."""
    heavy: tuple[HeavyCase, ...] = ()
    """The paper's heavy tasks: 7 kg box, 18 kg tyre, 65 kg crate with a partner."""
    stagnation: Stagnation | None = None
    """Infeasible pushes; empty: no suite."""
    robustness: Robustness | None = None
    """Conditions harder than the paper's; empty: no suite."""
    compliance: Compliance | None = None
    """Interaction with partners of different behaviour; empty: no suite."""
    map: PushMap | None = None
    """Pushes over rolling resistance and mass; empty: no suite."""
    probe: Probe | None = Field(default=None, json_schema_extra=LATER)
    """Linear probe of the object's mass on the policy's history; empty: no probe."""
    disturbances: bool = False
    """Enable random impulses on the object and pushes on the base, from the ranges of the simulation settings
    (`eval.simulation`, or training's). Trials of `compliance` and of planned pushes have none."""
    engine: Literal["mujoco", "drake"] = Field(default="mujoco", json_schema_extra=LATER)
    """Physics engine of the trials. Drake, an optional extra, runs the same trials of a policy trained in MuJoCo."""
    drake: Drake = Field(default=Drake(), json_schema_extra=LATER)
    success: Success = Success()
    video: Video = Field(default=Video(), json_schema_extra=COSMETIC)

    def problems(self) -> Problems:
        suites = {
            "heavy": self.heavy,
            "stagnation": () if self.stagnation is None else self.stagnation.cases,
            "robustness": () if self.robustness is None else self.robustness.cases,
        }
        for suite, cases in suites.items():
            names = [case.name for case in cases]
            repeated = sorted({name for name in names if names.count(name) > 1})
            if repeated:
                yield "", f"{suite}: {', '.join(repeated)} is the name of more than one case; give each its own"
        if not (self.measured or self.probe):
            valid = "lifting, pushing, squeezing, heavy, stagnation, robustness, compliance, map or probe"
            yield "", f"nothing to evaluate: give {valid}, or leave eval out of the stages"

    @property
    def sweeps(self) -> dict[str, MassSweep]:
        """The enabled sweeps by their name."""
        asked = {"lifting": self.lifting, "pushing": self.pushing, "squeezing": self.squeezing}
        return {kind: sweep for kind, sweep in asked.items() if sweep is not None}

    @property
    def measured(self) -> bool:
        """True if any suite measures tracking errors; a probe measures none."""
        return any((self.sweeps, self.heavy, self.stagnation, self.robustness, self.compliance, self.map))
