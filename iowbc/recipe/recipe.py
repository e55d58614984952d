"""The whole recipe: one experiment, from the reference generator to the exported policy."""

from typing import Any, Literal, Self, get_args

from pydantic import Field, field_validator

from iowbc.recipe.distillation import Distillation
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.execution import Execution
from iowbc.recipe.export import Export
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.recipe.scene_names import scene_name_problems
from iowbc.recipe.section import Problems, Section
from iowbc.recipe.simulation.holding import held_delay_problems
from iowbc.recipe.simulation.simulation import SimulationSettings
from iowbc.recipe.skill.skill import Skill
from iowbc.recipe.task.task import Task
from iowbc.recipe.teacher import Teacher

StageName = Literal["rg-dataset", "rg-fit", "teacher", "distill", "eval", "export", "skill", "skill-eval"]
PIPELINE: tuple[StageName, ...] = get_args(StageName)
"""All stages, in the order in which they run."""
CONTROLLER: tuple[StageName, ...] = ("rg-dataset", "rg-fit", "teacher", "distill", "eval", "export")
"""Stages of the controller, without those of the skill layer above it."""

SEEDS = ("seed", "teacher.seed", "distill.seed", "skill.learning.seed")
"""Dotted paths of the seeds, which distinguish repetitions of an experiment."""
NAME = "[a-z0-9][a-z0-9_-]*"
"""Pattern of an experiment's name, which is also used in file names."""


class Recipe(Section):
    """One experiment."""

    name: str = Field(pattern=f"^{NAME}$", max_length=64)
    """Name of the experiment: up to 64 lower-case letters, digits, `-` and `_`."""
    description: str = ""
    """Purpose of the experiment, in a sentence."""
    seed: int = Field(default=0, ge=0, lt=2**32)
    """Seed of all random numbers."""
    robot: str = "g1"
    """Folder under `robots/` that describes the robot."""
    stages: tuple[StageName, ...] = Field(default=CONTROLLER, min_length=1)
    """Stages of this experiment; they run in the order of the pipeline. `skill` and `skill-eval` run only if listed."""
    rg: ReferenceGenerator = ReferenceGenerator()
    simulation: SimulationSettings = SimulationSettings()
    task: Task = Task()
    teacher: Teacher = Teacher()
    distill: Distillation = Distillation()
    eval: Evaluation = Evaluation()
    export: Export = Export()
    skill: Skill = Skill()
    execution: Execution = Execution()

    @property
    def deployed(self) -> Self:
        """The recipe for a policy that does not observe s_priv: without custom parts of s_priv."""
        observation = self.task.observation.model_copy(update={"own": {}})
        return self.model_copy(update={"task": self.task.model_copy(update={"observation": observation})})

    def problems(self) -> Problems:
        student = self.distill
        unpaired = [units for units in (student.latent, *student.hidden) if units % 2]
        if self.teacher.symmetry == "construction" and unpaired:
            text = "with teacher.symmetry 'construction' the mirror swaps units of latent and hidden in pairs"
            yield "", f"distill: {text}; {unpaired[0]} is odd, give an even number"
        period, timesteps = 1.0 / self.task.control_frequency, {"simulation.physics": self.simulation.physics.timestep}
        if self.eval.simulation is not None:
            timesteps["eval.simulation.physics"] = self.eval.simulation.physics.timestep
        if self.eval.engine == "drake":
            timesteps["eval.drake"] = self.eval.drake.timestep
        for section, step in timesteps.items():
            steps = round(period / step)
            if steps < 1 or abs(steps * step - period) > 1e-9:
                better = f"take {period / max(1, steps):.6g} s"
                yield f"{section}.timestep", f"{step:g} s does not divide a control period of {period:g} s; {better}"
        decisions = self.task.control_frequency / self.skill.frequency
        if decisions < 1.0 or abs(decisions - round(decisions)) > 1e-9:
            better = f"take {self.task.control_frequency / max(1, round(decisions)):.6g} Hz"
            text = f"{self.skill.frequency:g} Hz does not divide the control frequency"
            yield "skill.frequency", f"{text} of {self.task.control_frequency:g} Hz; {better}"
        if self.rg.height == "com" and self.task.references.height is not None:
            text = "compares the pelvis with its commanded height"
            yield "task.references.height", f"{text}, and rg.height: com commands that of the centre of mass"
        if self.task.action.previous_share and self.eval.policy in ("model", "public"):
            yield "task.action.previous_share", f"eval.policy: {self.eval.policy} sets joint targets itself; take 0"
        yield from scene_name_problems(self)
        yield from held_delay_problems(self.eval, "eval", self.eval.simulation or self.simulation)

    @field_validator("stages")
    @classmethod
    def _in_order(cls, stages: tuple[StageName, ...]) -> tuple[StageName, ...]:
        repeated = sorted({name for name in stages if stages.count(name) > 1})
        if repeated:
            raise ValueError(f"names {', '.join(repeated)} more than once")
        return tuple(sorted(stages, key=PIPELINE.index))


def recipe_schema() -> dict[str, Any]:
    """JSON Schema of a recipe file: the fields with their docstrings, `extends`, and the `variants` of a study. No key
    is required, because sections may be partial; `iowbc plan` reports missing keys of list entries."""
    schema = Recipe.model_json_schema()
    for definition in (schema, *schema["$defs"].values()):
        definition.pop("required", None)
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    extends = {"type": "string", "description": "Recipe file, relative to this one, that this one changes."}
    variants = {"type": "array", "items": {"type": "string"}, "minItems": 2}
    variants["description"] = "Recipes that run one after another and are then compared, by name or file."
    schema["properties"] = {"extends": extends, "variants": variants, **schema["properties"]}
    return schema
