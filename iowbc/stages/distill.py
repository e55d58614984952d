"""Stage `distill`: the student drives, the teacher says what it would have done, the student learns it (DAgger)."""

import time

from iowbc.errors import Interrupted
from iowbc.pipeline.stage import Job, Stage
from iowbc.stages.inputs import ENVIRONMENTS, generator_stage

PANELS = ("kl", "action_rmse", "action_agreement", "episode_seconds", "teacher_share", "reward")
"""Shown in the figure of the learning curves."""


def run(job: Job) -> None:
    """Distil the teacher; leave the student's network, normalisation and curves."""
    import numpy as np
    import torch

    from iowbc.learning import checkpoint
    from iowbc.learning.acting import TeacherPolicy
    from iowbc.learning.curves import Curves
    from iowbc.learning.distillation import Experience, gradient_step, mirror_half, spread
    from iowbc.learning.history import History
    from iowbc.learning.networks import StudentNetwork
    from iowbc.learning.storage import load_teacher, save_network
    from iowbc.robot.description import load_robot
    from iowbc.task.mirror import action_mirror, observation_mirror
    from iowbc.task.vector.vector_env import VectorEnv

    torch.set_num_threads(1)  # small networks: more gain little, and stall wherever the cores are shared
    torch.manual_seed(job.recipe.seed)
    recipe, settings = job.recipe, job.recipe.distill
    teacher_net, about = load_teacher(job.inputs["teacher"])
    teacher = TeacherPolicy(teacher_net)
    environment = VectorEnv(
        recipe,
        job.robot,
        rg=job.inputs.get("rg-fit"),
        num_envs=settings.environments,
        workers=job.workers,
        seed=recipe.seed + 1,
    )
    try:
        environment.set_curriculum(about["curriculum"])
        layout = environment.layout
        size, actions = layout.observation.stop, environment.action_space.shape[0]
        architecture = {
            "observation": size,
            "history": settings.history,
            "actions": actions,
            "frame_features": settings.frame_features,
            "latent": settings.latent,
            "hidden": list(settings.hidden),
            "activation": settings.activation,
            "clip": recipe.teacher.normalization_clip,
        }
        student = StudentNetwork(**architecture)
        student.normalizer.mean.copy_(teacher_net.normalizer.mean[layout.observation])
        student.normalizer.std.copy_(teacher_net.normalizer.std[layout.observation])
        std = torch.clamp(teacher_net.log_std.exp(), min=settings.std_floor)
        optimizer = torch.optim.Adam(student.parameters(), settings.learning_rate)
        random = np.random.default_rng(recipe.seed)
        robot = load_robot(job.robot)
        mirrors = observation_mirror(robot, layout.state), action_mirror(robot)
        experience = Experience(settings.buffer, settings.environments, size, actions, settings.history)
        history = History(settings.environments, settings.history, size)
        starts = np.ones(settings.environments, np.bool_)
        teacher_drives = spread(settings.environments)
        rounds = -(-settings.steps // (settings.environments * settings.rollout))
        finished = 0

        path = job.work / "checkpoint.safetensors"
        found = checkpoint.load_checkpoint(path, job.key, job.report.say)
        if found is not None:
            arrays, state = found
            finished = state["rounds"]
            random.bit_generator.state = state["random"]
            checkpoint.restore_module(student, checkpoint.under("student", arrays))
            checkpoint.restore_optimizer(optimizer, checkpoint.under("optimizer", arrays))
            experience.restore(checkpoint.under("experience", arrays))
            environment.restore(checkpoint.under("environment", arrays))
            history.frames[:], starts[:] = arrays["history"], arrays["starts"]
            observation = arrays["observation"]
            job.report.say(f"resumed from its checkpoint at round {finished} of {rounds}")
        else:
            observation = environment.reset()
        curves = Curves(job.work / "curves.jsonl", finished * settings.environments * settings.rollout)

        def save(rounds_done: int) -> None:
            arrays = {
                **checkpoint.prefixed("student", checkpoint.module_arrays(student)),
                **checkpoint.prefixed("optimizer", checkpoint.optimizer_arrays(optimizer)),
                **checkpoint.prefixed("experience", experience.arrays()),
                **checkpoint.prefixed("environment", environment.state()),
                "history": history.frames,
                "starts": starts,
                "observation": observation,
            }
            state = {"rounds": rounds_done, "random": random.bit_generator.state}
            checkpoint.save_checkpoint(path, job.key, arrays, state)

        for current in range(finished + 1, rounds + 1):
            began = time.monotonic()
            progress = (current - 1) / rounds
            teacher_share = max(0.0, 1.0 - progress / settings.teacher_share) if settings.teacher_share else 0.0
            errors, targets_square = [], []
            for _ in range(settings.rollout):
                frame = observation[:, layout.observation]
                target = teacher.act(frame, observation[:, layout.privileged])
                frames = history.push(frame, starts)
                with torch.inference_mode():
                    action = student(torch.from_numpy(frames)).numpy()
                experience.add(frame, target, starts)
                errors.append(np.mean((action - target) ** 2))
                targets_square.append(np.mean(target**2))
                driven = np.where((teacher_drives < teacher_share)[:, None], target, action)
                observation, _, starts, _ = environment.step(driven)
            for group in optimizer.param_groups:
                group["lr"] = settings.learning_rate * (0.1 + 0.9 * 0.5 * (1 + np.cos(np.pi * progress)))
            losses = []
            for _ in range(settings.gradient_steps):
                histories, targets = experience.sample(settings.batch, random)
                if recipe.teacher.symmetry == "augment":
                    mirror_half(histories, targets, *mirrors, random)
                losses.append(gradient_step(student, optimizer, histories, targets, std, settings.gradient_norm))

            steps = current * settings.environments * settings.rollout
            values = {
                "kl": float(np.mean(losses)),
                "action_rmse": float(np.sqrt(np.mean(errors))),
                "action_agreement": float(1 - np.mean(errors) / np.mean(targets_square)),
                "teacher_share": teacher_share,
                "steps_per_second": settings.environments * settings.rollout / (time.monotonic() - began),
                **environment.statistics(),
            }
            curves.append(steps, values)
            job.report.metrics(values, steps)
            job.report.progress(steps, rounds * settings.environments * settings.rollout, f"KL {values['kl']:.3f}")
            stop = job.interrupted()
            if stop or current % settings.checkpoint_every == 0:
                save(current)
            if stop:
                raise Interrupted(f"stopped at round {current} of {rounds}, checkpoint written")
    finally:
        environment.close()

    save_network(student, architecture, job.out, "student", {"layout": layout.describe()})
    curves.write_artifact(job.out, f"{recipe.name}: student", PANELS)


STAGE = Stage(
    name="distill",
    version=2,
    slice=("seed", "rg.height", "simulation", "task", "teacher.symmetry", "teacher.normalization_clip", "distill"),
    reads=lambda recipe: (*generator_stage(recipe), "teacher"),
    run=run,
    packages=("stages.distill", "learning", *ENVIRONMENTS),
)
