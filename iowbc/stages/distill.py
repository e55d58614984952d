"""Stage `distill`: the student drives, the teacher says what it would have done, the student learns it (DAgger)."""

from iowbc.pipeline.stage import Job, Stage
from iowbc.stages.inputs import ENVIRONMENTS, generator_stage
from iowbc.stages.training import train

PANELS = ("kl", "action_rmse", "action_agreement", "episode_seconds", "teacher_share", "reward")
"""Shown in the figure of the learning curves."""


def run(job: Job) -> None:
    """Distil the teacher; leave the student's network, normalisation and curves."""
    import torch

    from iowbc.control.action import action_mirror
    from iowbc.learning.storage import load_teacher, save_network
    from iowbc.learning.student import StudentTraining
    from iowbc.robot.description import load_robot
    from iowbc.task.specification import Specification
    from iowbc.task.vector.vector_env import VectorEnv

    recipe, settings, robot = job.recipe, job.recipe.distill, load_robot(job.robot)
    torch.manual_seed(recipe.seed)
    teacher, about = load_teacher(job.inputs["teacher"])
    environments = VectorEnv(
        Specification(recipe, job.robot, job.inputs.get("rg-fit")),
        num_envs=settings.environments,
        workers=job.workers,
        seed=recipe.seed + 1,
    )
    try:
        environments.set_curriculum(about["curriculum"])
        layout, mirrors = environments.layout, None
        if recipe.teacher.symmetry != "none":
            mirrors = layout.state.mirror, action_mirror(robot)
        places = layout.observation, layout.privileged
        training = StudentTraining(settings, environments, teacher, places, mirrors, recipe.seed)
        curves = train(job, training, settings.checkpoint_every, lambda values: f"KL {values['kl']:.3f}")
    finally:
        environments.close()

    save_network(training.network, training.architecture, job.out, "student", {"layout": layout.describe()})
    job.summarize(curves.write_artifact(job.out, f"{recipe.name}: student", PANELS))


STAGE = Stage(
    name="distill",
    version=2,
    slice=("seed", "rg.height", "simulation", "task", "teacher.symmetry", "teacher.normalization_clip", "distill"),
    reads=lambda recipe: (*generator_stage(recipe), "teacher"),
    run=run,
    results=("student.safetensors", "student.json"),
    packages=("stages.distill", "stages.training", "learning", *ENVIRONMENTS),
)
