"""The whole recipe: one experiment, from the reference generator to the exported policy."""

from collections.abc import Mapping
from typing import Any, Literal, Self, get_args

from pydantic import Field, field_validator

from iowbc.errors import nearest
from iowbc.recipe.distillation import Distillation
from iowbc.recipe.evaluation.evaluation import Evaluation, TrialScene
from iowbc.recipe.execution import Execution
from iowbc.recipe.export import Export
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.recipe.section import Problems, Section, marked_fields
from iowbc.recipe.simulation.holding import WITH_OBJECT, held_delay_problems
from iowbc.recipe.simulation.scene import Scenes
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
LONGEST_NAME = 64
"""Maximum length of such a name [characters]."""


class Recipe(Section):
    """One experiment."""

    name: str = Field(pattern=f"^{NAME}$", max_length=LONGEST_NAME)
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

    @property
    def student_sees_object(self) -> bool:
        """True if the deployed policy observes the object: a distilled student may lack it."""
        return self.task.observation.observe_object and (self.distill.observe_object or "distill" not in self.stages)

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
        if self.rg.height == "com" and self.eval.policy in ("model", "public"):
            yield "rg.height", f"com commands the centre of mass; eval.policy: {self.eval.policy} follows the pelvis"
        if self.task.action.previous_share and self.eval.policy in ("model", "public"):
            yield "task.action.previous_share", f"eval.policy: {self.eval.policy} sets joint targets itself; take 0"
        yield from _scene_name_problems(self)
        yield from held_delay_problems(self.eval, "eval", self.eval.simulation or self.simulation)

    @field_validator("stages")
    @classmethod
    def _in_order(cls, stages: tuple[StageName, ...]) -> tuple[StageName, ...]:
        repeated = sorted({name for name in stages if stages.count(name) > 1})
        if repeated:
            raise ValueError(f"names {', '.join(repeated)} more than once")
        return tuple(sorted(stages, key=PIPELINE.index))


def _scene_name_problems(recipe: Recipe) -> Problems:
    """Invalid scene names and incomplete custom scenes: pairs of a dotted path and a message."""
    task, evaluation, trained = recipe.task, recipe.eval, recipe.simulation.scenes
    worlds = {"simulation.scenes": trained}
    if evaluation.simulation is not None:
        worlds["eval.simulation.scenes"] = evaluation.simulation.scenes
    named = tuple(dict.fromkeys(name for scenes in worlds.values() for name in scenes.names))
    for path, entries, known in (
        ("task.scenes", task.scenes, trained.names),
        ("task.references.grasps", task.references.grasps, named),
        ("task.references.loads", task.references.loads, named),
    ):
        for name in entries.own:
            if name not in known:
                text = f"no scene {name!r} in simulation.scenes; there are: {', '.join(known)}{nearest(name, known)}"
                yield f"{path}.{name}", text
    for path, scenes in worlds.items():
        for name in scenes.own:
            yield from _incomplete(f"{path}.{name}", name, scenes, task)
    for place, name in (
        *((f"teacher.check.others.{name}", name) for name in recipe.teacher.check.others),
        *marked_fields(recipe.export, "export", WITH_OBJECT),
        *marked_fields(recipe.skill, "skill", WITH_OBJECT),
    ):
        yield from _without_object(place, name, "simulation.scenes", trained)
    path, scenes = list(worlds.items())[-1]
    if evaluation.scenes:
        path, scenes = f"{path} and eval.scenes", with_scenes(scenes, evaluation.scenes)
    for place, name in marked_fields(evaluation, "eval", WITH_OBJECT):
        yield from _without_object(place, name, path, scenes)


def with_scenes(scenes: Scenes, further: Mapping[str, TrialScene]) -> Scenes:
    """Scenes merged with those of the trials, which may replace some."""
    return Scenes.model_validate({**dict(scenes), **{name: own.scene for name, own in further.items()}})


def _incomplete(path: str, name: str, scenes: Scenes, task: Task) -> Problems:
    """Missing entries of a custom scene."""
    scene, references = getattr(scenes, name), task.references
    if name not in references.grasps.names:
        near = references.grasps.push if scene.kind == "push" else references.grasps.lift
        text = "has no base grasp: give the left wrist's place from the pelvis [m], for example"
        yield path, f"{text} task.references.grasps.{name}: {list(near)}"
    if name not in references.loads.names:
        half = 0.5 * scene.object.mass if scene.kind == "lift" else 0.0
        text = "does not say what the arms expect to carry [kg]: give, for example"
        yield path, f"{text} task.references.loads.{name}: {half:g}"


def _without_object(path: str, name: str, where: str, scenes: Scenes) -> Problems:
    loaded = [known for known in scenes.names if getattr(scenes, known).object is not None]
    if name not in loaded:
        text = f"no scene {name!r} with an object; valid: {', '.join(loaded)}; a mass of 0 is without one"
        yield path, f"{text}; see {where}{nearest(name, loaded)}"


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
