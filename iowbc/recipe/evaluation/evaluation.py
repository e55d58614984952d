"""Evaluation: the suites of trials, their world, and the films of them."""

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from iowbc.recipe.evaluation.model_based import ModelBased
from iowbc.recipe.evaluation.public_controller import PublicController
from iowbc.recipe.evaluation.sequences import DrawnScripts, Segment
from iowbc.recipe.evaluation.suites import Compliance, HeavyCase, MassSweep, Probe, PushMap, Robustness, Stagnation
from iowbc.recipe.section import COSMETIC, LATER, OwnName, Section
from iowbc.recipe.simulation.scene import Object, Scene
from iowbc.recipe.simulation.simulation import SimulationSettings


class Drake(Section):
    """Integration by Drake; masses, gains, friction and all that is drawn are those of `simulation`."""

    timestep: float = Field(default=0.004, gt=0.0, le=0.02)
    """Physics step [s]; a whole number of them makes a control period. At 2 ms most trials end alike."""
    contact: Literal["sap", "lagged", "similar"] = "lagged"
    """Contact approximation of the SAP solver: linear damping (`sap`) or that of Hunt and Crossley (`lagged`,
    `similar`). All but `lagged` let a contact that slides push apart as well."""
    ground_stiffness: float = Field(default=2e5, gt=0.0)
    """Stiffness of a contact point of the soles [N/m]: on eight a robot sinks 0.2 mm into the ground, as in MuJoCo."""
    body_stiffness: float = Field(default=1e4, gt=0.0)
    """Stiffness of contacts of the object with palms and links, and of links with each other [N/m]: a box of 8 kg that
    hits a thigh is stopped with the force of MuJoCo's contact, whose time constant is 20 ms. Ten times as stiff, the
    same hit tears it out of the hands."""
    relaxation: float = Field(default=0.02, ge=0.0)
    """Time constant of the linear damping of a contact [s], that of MuJoCo's."""
    dissipation: float = Field(default=2.0, ge=0.0)
    """Damping of Hunt and Crossley, over stiffness and force [s/m]."""
    stiction: float = Field(default=1e-3, gt=0.0)
    """Speed below which friction is regularised: of sliding contacts and crates [m/s], and of joints [rad/s]. At its
    limit of friction a crate at rest creeps at this speed, as in MuJoCo."""


class Success(Section):
    """Survival: no fall and nothing dropped, by `task.termination`, for the whole trial. Success: survival and
    transport of what the hands carry or do not lose; beside a partner also bounded force; where a push is infeasible,
    survival, posture, feet that stay and a push that goes on. A robot that stands still never succeeds."""

    slip_fails: bool = False
    """Also count a trial as failed in which a hand ever lost the object, even though the other kept it."""
    transport: float = Field(default=0.5, ge=0, le=1)
    """Part of the commanded displacement that robot and object must cover; a robot that stands still covers none."""
    weight_in_hands: float = Field(default=0.95, ge=0, le=1)
    """Part of a held object's weight, less the partner's share, that must rest in the hands on average; the rest lies
    on thighs or torso."""
    least_weight: float = Field(default=5.0, ge=0)
    """Weight on the robot under which nobody asks where it rests [N]: a box of 0.05 kg weighs a tenth of this, and a
    touch of the torso is several times its weight."""
    object_beside: float = Field(default=0.35, gt=0, json_schema_extra=LATER)
    """A pushed object that is ever further than this to the robot's side is lost [m]: the middle of the hands is then
    past the edge of a crate that is 0.6 m wide. A held one may be as far from its place (`object_distance`)."""
    push_force: float = Field(default=0.5, ge=0, le=1)
    """Part of what friction allows that the hands push with in a stagnating push that is a success. Friction allows
    μ times the vertical force of the ground on both feet, or the crate's rolling resistance where that is smaller;
    both forces are averaged over a gait period."""
    push_time: float = Field(default=0.5, ge=0, le=1)
    """Part of the time in which steps are commanded for which they have to push so."""
    foot_slide: float = Field(default=0.1, gt=0)
    """Largest mean speed at which the loaded soles slide, both feet together, in a stagnating push that is a success
    [m/s]: twice that of a robot that walks."""
    handle_force: float = Field(default=50.0, gt=0)
    """Largest 95th percentile of the horizontal force between partner and object in a trial of compliance that is a
    success [N]: a little above the 40 N of a firm pull of one arm, well below the 80 N at which the partner's own
    arms give in."""
    hand_force: float = Field(default=90.0, gt=0)
    """Largest 95th percentile of the horizontal force at either hand before a blocked crate in such a trial [N]. Both
    together then push with 180 N at most, half of what the best ground of training (friction 1.2) allows."""
    least_push: float = Field(default=20.0, ge=0)
    """Least mean force of both hands before a blocked crate in such a trial, while steps are commanded [N]: a robot
    that does not push has nothing to yield to."""
    compliance_transport: float = Field(default=0.25, ge=0, le=1)
    """Part of the commanded displacement that robot and object must cover in such a trial: half of `transport`, for the
    partner stops, lags and leads elsewhere."""
    posture_pitch: float = Field(default=0.3, gt=0)
    """Largest mean error of the torso pitch of a stagnating push that is a success [rad]; twice the paper's E_α."""
    posture_height: float = Field(default=0.05, gt=0)
    """Largest mean error of the height of a stagnating push that counts as success [m]; 2.5 times the paper's E_h."""
    capacity_rate: float = Field(default=0.8, gt=0, le=1, json_schema_extra=COSMETIC)
    """Success rate that a mass, and every lighter one, must reach to count as carried (load capacity)."""


class Video(Section):
    """Short films of trials."""

    count: int = Field(default=2, ge=0, le=1000)
    """Number of films, spread over the sweeps' masses; 0 makes none."""
    width: int = Field(default=640, ge=64, le=3840, multiple_of=16)
    """Width of a frame [pixel]; video codecs want multiples of 16."""
    height: int = Field(default=480, ge=64, le=2160, multiple_of=16)
    """Height of a frame [pixel]."""
    fps: int = Field(default=20, ge=1, le=50)
    """Frames per second; a frame takes 0.1 to 0.2 s to draw without a graphics card."""
    duration: float = Field(default=12.0, gt=0)
    """Longest film [s]."""
    traces: bool = True
    """Draw scene, mass, time and command into the frames."""


class TrialScene(Section):
    """A scene beside those of the training. What the policy observes does not change with it."""

    scene: Scene
    """The object and how it is held; it may also replace a scene of the training."""
    wrists: tuple[float, float, float]
    """Base grasp: left wrist from the pelvis, heading frame [m]; as an entry of `task.references.grasps`."""
    load: float | None = Field(default=0.0, ge=0.0)
    """Load that the arms expect to carry [kg], as an entry of `task.references.loads`; empty takes that of `lift`."""


BESIDE = 0.035
"""Distance of a wrist from the side of the box in its hands [m], in the scene `lift`."""


def box(width: float) -> TrialScene:
    """The box of the scene `lift` in another width [m], held as there."""
    thing = Object(shape="box", size=(0.30, width, 0.30), mass=7.0)
    return TrialScene(scene=Scene(kind="lift", object=thing), wrists=(0.30, width / 2 + BESIDE, 0.26), load=None)


SIZES = {"narrow_box": box(0.2), "wide_box": box(0.45)}
"""Boxes beyond the training's 0.25 m."""


class Evaluation(Section):
    """Trials of the trained policy."""

    policy: Literal["student", "teacher", "model", "public"] = "student"
    """The acting policy: the deployable student, the teacher with its privileged observation, the quadratic program of
    `model`, which nothing is trained for, or the controller of `public`, which others trained."""
    model: ModelBased = Field(default=ModelBased(), json_schema_extra=LATER)
    """The model-based rival: tasks and limits of its quadratic program."""
    public: PublicController | None = Field(default=None, json_schema_extra=LATER)
    """A controller that others trained, for the policy `public`."""
    label: str = Field(default="IO-WBC", min_length=1, max_length=200, json_schema_extra=COSMETIC)
    """Name of the variant in tables and figures; the paper's are IO-WBC, WBC, w/o RG, w/o Distill."""
    trials: int = Field(default=5, ge=1, le=10_000)
    """Trials per mass; trial k of every mass and variant has the same seed, and the same drawn script."""
    split: Literal["test", "development"] = "test"
    """Whose seeds the trials have. Those of `test` are in the tables and nothing is chosen by them; those of
    `development`, which `teacher.check` has as well, are for choosing between trainings. The two never meet."""
    seed: int = Field(default=1000, ge=0, lt=2**32)
    """Seed of the first trial, within its split."""
    sequence: tuple[Segment, ...] = ()
    """Commands of every sweep and case that has none of its own, in order; their durations add up to the trial's.
    Empty takes `scripts`."""
    scripts: DrawnScripts | None = None
    """Scripts drawn trial by trial for every sweep and case without a sequence; empty takes the fixed sequence of
    lifting or pushing."""
    simulation: SimulationSettings | None = None
    """The world of all trials; empty is the training's. Pinned (`{}` to the default), variants that were trained
    in other worlds meet the same trials."""
    scenes: dict[OwnName, TrialScene] = Field(default=SIZES)
    """Further scenes of the trials, by name: other objects, sizes and grasps for a policy that is trained already."""
    batch: int = Field(default=64, ge=1, le=10_000)
    """Trials played at once, over all workers. A policy computes in the shape of a whole batch, so that a trial is the
    same bit for bit when it is played again alone; another size rounds differently."""
    foot_load: float = Field(default=50.0, gt=0)
    """Vertical force from which a foot counts as loaded when its sliding is measured [N]; 15 % of the weight."""
    lifting: MassSweep | None = MassSweep()
    """Masses lifted (paper's Table II); empty leaves the sweep out."""
    pushing: MassSweep | None = None
    """Masses pushed (paper's Table III), with a rolling resistance; empty leaves the sweep out."""
    squeezing: MassSweep | None = None
    """Masses held between the palms by friction alone, in a scene such as `squeeze`; empty leaves the sweep out."""
    heavy: tuple[HeavyCase, ...] = ()
    """The paper's heavy tasks: 7 kg box, 18 kg tyre, 65 kg crate with a partner."""
    stagnation: Stagnation | None = None
    """Pushes that cannot succeed; empty leaves the suite out."""
    robustness: Robustness | None = None
    """Conditions harder than the paper's; empty leaves the suite out."""
    compliance: Compliance | None = None
    """Interaction with partners of different behaviour; empty leaves the suite out."""
    map: PushMap | None = None
    """Pushes over rolling resistance and mass; empty leaves the suite out."""
    probe: Probe | None = Field(default=None, json_schema_extra=LATER)
    """A linear probe of what the policy's history knows of the object's mass; empty leaves it out."""
    disturbances: bool = False
    """Keep the impulses on the object and the pushes on the base during trials, drawn from the ranges of the
    world (`eval.simulation`, or the training's). Trials of `compliance` and of planned pushes are without them."""
    engine: Literal["mujoco", "drake"] = Field(default="mujoco", json_schema_extra=LATER)
    """Physics engine of the trials. Drake, which is an extra, plays the same trials of a policy trained in MuJoCo."""
    drake: Drake = Field(default=Drake(), json_schema_extra=LATER)
    """How Drake integrates."""
    success: Success = Success()
    """When a trial counts as survived."""
    video: Video = Field(default=Video(), json_schema_extra=COSMETIC)
    """Short films of trials."""

    def problems(self) -> Iterator[tuple[str, str]]:
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
        """The sweeps, by what is done with the objects."""
        asked = {"lifting": self.lifting, "pushing": self.pushing, "squeezing": self.squeezing}
        return {kind: sweep for kind, sweep in asked.items() if sweep is not None}

    @property
    def measured(self) -> bool:
        """True where there are trials whose errors are measured: a probe has none."""
        return any((self.sweeps, self.heavy, self.stagnation, self.robustness, self.compliance, self.map))
