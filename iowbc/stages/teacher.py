"""Stage `teacher`: PPO with privileged information on the vector environment, resumable at every checkpoint."""

from iowbc.pipeline.stage import Job, Stage
from iowbc.stages.inputs import ENVIRONMENTS, generator_stage
from iowbc.stages.training import train

PANELS = (
    "episode_seconds",
    "reward",
    "curriculum_level",
    "train/kl",
    "train/clip_share",
    "train/learning_rate",
    "train/std",
    "train/explained_variance",
)
"""Shown in the figure of the learning curves, before the reward's terms."""


def run(job: Job) -> None:
    """Train the teacher; leave its network, normalisation, curves, and an SB3 zip for users' own code."""
    from iowbc.control.action import action_mirror
    from iowbc.learning.storage import save_network
    from iowbc.learning.teacher import TeacherTraining
    from iowbc.processes import available_cores
    from iowbc.robot.description import load_robot
    from iowbc.task.specification import Specification
    from iowbc.task.vector.vector_env import VectorEnv

    recipe, settings, robot = job.recipe, job.recipe.teacher, load_robot(job.robot)
    environments = VectorEnv(
        Specification(recipe, job.robot, job.inputs.get("rg-fit")),
        num_envs=settings.environments,
        workers=job.workers,
        seed=recipe.seed,
        divergences=job.work / "divergences",
    )
    try:
        mirrors = environments.layout.mirror, action_mirror(robot)
        training = TeacherTraining(settings, environments, mirrors, recipe.seed, available_cores())
        curves = train(
            job, training, settings.checkpoint_every, lambda values: f"{values['episode_seconds']:.1f} s an episode"
        )
        network, architecture = training.network()
        about = {"layout": environments.layout.describe(), "curriculum": environments.curriculum()}
    finally:
        environments.close()

    save_network(network, architecture, job.out, "teacher", about)
    training.model.save(job.out / "teacher_sb3.zip")
    if (job.work / "divergences").is_dir():
        (job.work / "divergences").rename(job.out / "divergences")
    terms = sorted({name for row in curves.rows for name in row if name.startswith("reward/")})
    job.summarize(curves.write_artifact(job.out, f"{recipe.name}: teacher", PANELS, terms))


STAGE = Stage(
    name="teacher",
    version=2,
    slice=("seed", "rg.height", "simulation", "task", "teacher"),
    reads=generator_stage,
    run=run,
    results=("teacher.safetensors", "teacher.json"),
    packages=("stages.teacher", "stages.training", "learning", *ENVIRONMENTS),
)
