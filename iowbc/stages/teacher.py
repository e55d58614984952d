"""Stage `teacher`: PPO with privileged information on the vector environment, resumable at every checkpoint."""

import math
import time

from iowbc.errors import Interrupted, StageFailed
from iowbc.pipeline.stage import Job, Stage
from iowbc.stages.inputs import ENVIRONMENTS, generator_stage

PANELS = (
    "episode_seconds",
    "reward",
    "curriculum_level",
    "train/approx_kl",
    "learning_rate",
    "train/std",
    "train/explained_variance",
)
"""Shown in the figure of the learning curves, before the reward's terms."""


def run(job: Job) -> None:
    """Train the teacher; leave its network, normalisation, curves, and an SB3 zip for users' own code."""
    import torch

    from iowbc.learning import checkpoint, ppo
    from iowbc.learning.curves import Curves
    from iowbc.learning.storage import save_network
    from iowbc.robot.description import load_robot
    from iowbc.task.mirror import action_mirror, observation_mirror
    from iowbc.task.vector.vector_env import VectorEnv

    torch.set_num_threads(1)  # small networks: more gain little, and stall wherever the cores are shared
    recipe, settings = job.recipe, job.recipe.teacher
    environment = VectorEnv(
        recipe,
        job.robot,
        rg=job.inputs.get("rg-fit"),
        num_envs=settings.environments,
        workers=job.workers,
        seed=recipe.seed,
        divergences=job.work / "divergences",
    )
    try:
        robot = load_robot(job.robot)
        mirrors = None
        if settings.symmetry == "augment":
            mirrors = observation_mirror(robot, environment.layout), action_mirror(robot)
        env = ppo.normalize(environment, settings, mirrors)
        model = ppo.make_ppo(settings, env, recipe.seed, mirrors)
        path = job.work / "checkpoint.safetensors"
        found = checkpoint.load_checkpoint(path, job.key, job.report.say)
        if found is not None:
            arrays, _ = found
            environment.restore(checkpoint.under("environment", arrays))
            ppo.restore_ppo(model, env, arrays)
            job.report.say(f"resumed from its checkpoint at {model.num_timesteps:,} of {settings.steps:,} steps")
        curves = Curves(job.work / "curves.jsonl", model.num_timesteps)
        clock = _Clock(model.num_timesteps)

        def save() -> None:
            arrays = {
                **ppo.ppo_arrays(model, env),
                **checkpoint.prefixed("environment", environment.state()),
            }
            checkpoint.save_checkpoint(path, job.key, arrays, {})

        def after_update(training: dict[str, float]) -> None:
            steps = model.num_timesteps
            if not all(math.isfinite(value) for value in training.values()):
                raise StageFailed(
                    f"the networks diverged at {steps:,} steps; lower teacher.learning_rate or teacher.largest_kl"
                )
            rate = ppo.adapt_learning_rate(model, settings, training["train/approx_kl"])
            values = {**environment.statistics(), **training, "learning_rate": rate}
            values["steps_per_second"] = clock.rate(steps)
            curves.append(steps, values)
            job.report.metrics(values, steps)
            job.report.progress(
                min(steps, settings.steps), settings.steps, f"{values['episode_seconds']:.1f} s an episode"
            )
            updates = steps // (settings.environments * settings.rollout)
            stop = job.interrupted()
            if stop or updates % settings.checkpoint_every == 0:
                save()
            if stop:
                raise Interrupted(f"stopped at {steps:,} of {settings.steps:,} steps, checkpoint written")

        if model.num_timesteps < settings.steps:
            model.learn(
                settings.steps - model.num_timesteps,
                callback=ppo.AfterUpdate(after_update),
                log_interval=None,  # never dumps: the figures are read after each update
                reset_num_timesteps=False,
            )
        save()

        network, architecture = ppo.teacher_network(model, env, settings)
        about = {"layout": environment.layout.describe(), "curriculum": environment.curriculum()}
        save_network(network, architecture, job.out, "teacher", about)
        model.save(job.out / "teacher_sb3.zip")
        if (job.work / "divergences").is_dir():
            (job.work / "divergences").rename(job.out / "divergences")
        terms = sorted({name for row in curves.rows for name in row if name.startswith("reward/")})
        curves.write_artifact(job.out, f"{recipe.name}: teacher", PANELS, terms)
    finally:
        environment.close()


class _Clock:
    """Environment steps a second since the previous call."""

    def __init__(self, steps: int) -> None:
        self.steps, self.time = steps, time.monotonic()

    def rate(self, steps: int) -> float:
        now = time.monotonic()
        rate = (steps - self.steps) / (now - self.time)
        self.steps, self.time = steps, now
        return rate


STAGE = Stage(
    name="teacher",
    version=1,
    slice=("seed", "rg.height", "simulation", "task", "teacher"),
    reads=generator_stage,
    run=run,
    packages=("stages.teacher", "learning", *ENVIRONMENTS),
)
