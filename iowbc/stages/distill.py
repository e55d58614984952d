"""Stage `distill`: the student acts, the teacher labels the states with actions, the student imitates (DAgger)."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

from iowbc.errors import StageFailed
from iowbc.pipeline.stage import ExternalInput, Job, Stage
from iowbc.recipe.distillation import Distillation
from iowbc.recipe.recipe import Recipe
from iowbc.stages.inputs import generator_stage, not_privileged
from iowbc.stages.training import rolls_elsewhere, train

PANELS = (
    "kl",
    "kl_at_shared_std",
    "auxiliary_error",
    "std",
    "action_rmse",
    "action_agreement",
    "episode_seconds",
    "terminations/fallen",
    "teacher_share",
    "reward",
)
"""Shown in the figure of the learning curves."""
FACTS = ("object_mass", "base_linear_velocity")
"""Privileged observations (load and base velocity) that the auxiliary loss predicts from the latent."""


def problems(recipe: Recipe) -> Iterator[tuple[str, str]]:
    """Problems: a teacher that is a student, names not in s_priv, or scenes and experts that do not match."""
    yield from not_privileged(recipe, "distill.withheld", recipe.distill.withheld)
    if experts := recipe.distill.experts:
        played = [name for name, share in recipe.task.scenes if share > 0.0]
        for scene in (name for name in played if name not in experts):
            yield "distill.experts", f"the scene {scene} is played and has no expert; name one for each of {played}"
        for scene in (name for name in experts if name not in played):
            yield f"distill.experts.{scene}", f"no scene {scene} is played; valid: {', '.join(played)}"
    if recipe.teacher.history is not None:
        text = "with teacher.history PPO trains the student's network itself, and nothing is to be distilled: leave "
        yield "stages", f"{text}`distill` out, or set teacher.history to null"


def run(job: Job) -> None:
    """Distil the teacher, or in each scene its expert; leave the student's network, normalisation and curves."""
    import numpy as np

    from iowbc.control.action import action_mirror
    from iowbc.control.observation import observation_layout
    from iowbc.learning.computing import prepare_process
    from iowbc.learning.storage import load_network, require_layout, save_network
    from iowbc.learning.student import Rows, StudentTraining
    from iowbc.robot.description import load_robot
    from iowbc.robot.mirror import side_by_side
    from iowbc.stages.environments import training_environments
    from iowbc.task.vector.setup import scene_of

    prepare_process()
    recipe, settings, robot = job.recipe, job.recipe.distill, load_robot(job.robot)
    seed = recipe.seed if settings.seed is None else settings.seed
    scenes = scene_of(settings.environments, recipe.task.scenes)
    folder_of = {scene: job.inputs[f"expert/{scene}" if settings.experts else "teacher"] for scene in scenes}
    folders = list(dict.fromkeys(folder_of.values()))
    teachers, abouts = zip(*(load_network(folder, ("teacher",)) for folder in folders), strict=True)
    about = abouts[0]
    with closing(training_environments(job, count=settings.environments, seed=seed + 1)) as environments:
        levels = dict(about["curriculum"]["levels"])
        for scene, folder in folder_of.items():  # each scene those of its own expert
            known = abouts[folders.index(folder)].get("curriculum", {"levels": {}})["levels"]
            if scene in known:
                levels[scene] = known[scene]
        environments.set_curriculum({"levels": levels})
        layout = environments.layout
        own = dict(zip(layout.extra.names, layout.extra.mirrors, strict=True))
        seen = observation_layout(robot, recipe.task.observation.observe_object and settings.observe_object)
        for folder, one in zip(folders, abouts, strict=True):
            require_layout(folder, one, layout.describe())
            if one["kind"] == "student":
                _require_sizes(folder, one["architecture"], settings, seen.size)
        unseen = layout.state.parts[len(seen.parts) :]
        unseen_mirror = side_by_side([*(part.kind(robot) for part in unseen), layout.extra.mirror])
        rows = Rows(
            observation=slice(0, seen.size),
            privileged=slice(seen.size, layout.size),
            facts=layout.privileged_places(FACTS),
            withheld=layout.privileged_places(settings.withheld) - seen.size,
            observation_mirror=seen.mirror,
            privileged_mirror=unseen_mirror.as_float32(),
            facts_mirror=side_by_side([own[name] for name in FACTS]),
            action_mirror=action_mirror(robot),
        )
        owners, architecture = np.array([folders.index(folder_of[scene]) for scene in scenes]), about["architecture"]
        training = StudentTraining(
            settings, environments, teachers, owners, architecture, rows, recipe.teacher.symmetry, seed
        )
        curves = train(job, training, settings.checkpoint_every, _note)
        curriculum = environments.curriculum()

    layouts = {"observation": seen.describe(), "privileged": layout.describe()["privileged"]}
    about = {"layout": layouts, "curriculum": curriculum}
    save_network(training.network, training.architecture, job.out, "student", about)
    job.summarize(curves.write_artifact(job.out, f"{recipe.name}: student", PANELS))


def _require_sizes(folder: Path, expert: Mapping[str, Any], settings: Distillation, observation: int) -> None:
    """Raises StageFailed for an expert that is a student with a history or an encoder of other sizes."""
    sizes = {name: getattr(settings, name) for name in ("history", "frame_features", "latent")}
    for name, size in (sizes | {"observation": observation}).items():
        if expert[name] != size:
            raise StageFailed(f"{folder}: this expert's {name} has size {expert[name]}, that of distill {size}")


def _note(values: Mapping[str, float]) -> str:
    name = "kl" if "kl" in values else "kl_at_shared_std"
    return f"KL {values[name]:.3f}, agreement {values['action_agreement']:.2f}"


STAGE = Stage(
    name="distill",
    version=4,
    slice=("seed", "rg.height", "simulation", "task", "teacher.symmetry", "teacher.normalization_clip", "distill"),
    reads=lambda recipe: (*generator_stage(recipe), *(() if recipe.distill.experts else ("teacher",))),
    borrows=lambda recipe: {
        f"expert/{scene}": ExternalInput(f"distill.experts.{scene}", named, "teacher")
        for scene, named in recipe.distill.experts.items()
    },
    run=run,
    problems=problems,
    results=("student.safetensors", "student.json"),
    counts=("distill.steps",),
    headline=("kl", "action_agreement", "episode_seconds"),
    columns=("action_agreement",),
    curves=("kl", "action_agreement", "episode_seconds"),
    trained_by="distillation",
    leaves_policy=True,
    spreads=rolls_elsewhere,
)
