"""What is evaluated: the suites of trials, their world, and what counts as success."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from iowbc.recipe.evaluation.compliance import Compliance
from iowbc.recipe.evaluation.model_based import ModelBased
from iowbc.recipe.evaluation.probe import Probe
from iowbc.recipe.evaluation.public import PublicController
from iowbc.recipe.evaluation.push_map import PushMap
from iowbc.recipe.evaluation.scripts import DrawnScripts
from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.evaluation.success import Success
from iowbc.recipe.evaluation.suites import HeavyCase, Robustness, Stagnation, Sweep
from iowbc.recipe.evaluation.trial_scenes import SIZES, TrialScene
from iowbc.recipe.evaluation.video import Video
from iowbc.recipe.section import COSMETIC, LATER, OWN_NAME, Section
from iowbc.recipe.simulation.simulation import Simulation

SceneName = Annotated[str, Field(pattern=f"^{OWN_NAME}$")]


class Evaluation(Section):
    """Trials of the trained policy."""

    policy: Literal["student", "teacher", "model", "public"] = "student"
    """What acts: the deployable student, the teacher with its privileged observation, the quadratic program of `model`,
    which nothing is trained for, or the controller of `public`, which others trained."""
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
    simulation: Simulation | None = None
    """The world of all trials; empty is the training's. Pinned (`{}` to the default), variants that were trained
    in other worlds meet the same trials."""
    scenes: dict[SceneName, TrialScene] = Field(default=SIZES)
    """Further scenes of the trials, by name: other objects, sizes and grasps for a policy that is trained already."""
    batch: int = Field(default=64, ge=1, le=10_000)
    """Trials played at once, over all workers. A policy computes in the shape of a whole batch, so that a trial is the
    same bit for bit when it is played again alone; another size rounds differently."""
    foot_load: float = Field(default=50.0, gt=0)
    """Vertical force from which a foot counts as loaded when its sliding is measured [N]; 15 % of the weight."""
    lifting: Sweep | None = Sweep()
    """Masses lifted (paper's Table II); empty leaves the sweep out."""
    pushing: Sweep | None = None
    """Masses pushed (paper's Table III), with a rolling resistance; empty leaves the sweep out."""
    squeezing: Sweep | None = None
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
    """Keep the impulses on the object and the pushes on the base during trials, at their nominal strength. Trials of
    `compliance` and those of planned pushes are without them."""
    success: Success = Success()
    """When a trial counts as survived."""
    video: Video = Field(default=Video(), json_schema_extra=COSMETIC)
    """Short films of trials."""

    @model_validator(mode="after")
    def _cases_told_apart(self) -> Self:
        suites = {
            "heavy": self.heavy,
            "stagnation": () if self.stagnation is None else self.stagnation.cases,
            "robustness": () if self.robustness is None else self.robustness.cases,
        }
        for suite, cases in suites.items():
            names = [case.name for case in cases]
            repeated = sorted({name for name in names if names.count(name) > 1})
            if repeated:
                raise ValueError(f"{suite}: {', '.join(repeated)} is the name of more than one case; give each its own")
        return self

    @model_validator(mode="after")
    def _something_to_do(self) -> Self:
        if not (self.measured or self.probe):
            raise ValueError(
                "nothing to evaluate: give lifting, pushing, squeezing, heavy, stagnation, robustness, compliance, map "
                "or probe, or leave eval out of the stages"
            )
        return self

    @property
    def sweeps(self) -> dict[str, Sweep]:
        """The sweeps, by what is done with the objects."""
        asked = {"lifting": self.lifting, "pushing": self.pushing, "squeezing": self.squeezing}
        return {kind: sweep for kind, sweep in asked.items() if sweep is not None}

    @property
    def measured(self) -> bool:
        """Whether there are trials whose errors are measured: a probe has none."""
        return any((self.sweeps, self.heavy, self.stagnation, self.robustness, self.compliance, self.map))
