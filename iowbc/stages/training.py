"""Shared by the stages that train: updates until the budget is spent, curves, checkpoints, stopping and going on."""

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from iowbc.errors import Interrupted, StageFailed
from iowbc.pipeline.stage import Job
from iowbc.recipe.recipe import Recipe

if TYPE_CHECKING:
    from iowbc.learning.curves import Curves
    from iowbc.learning.student import StudentTraining
    from iowbc.learning.teacher import TeacherTraining
    from iowbc.skill.learner import SkillTraining

    Training = TeacherTraining | StudentTraining | SkillTraining
    """A training that goes one update at a time."""

STATE = "state.safetensors"
"""File of an artifact with the state from which a longer training continues, together with its table of curves."""
CURVES = "curves.jsonl"
"""File with the curves of an unfinished training."""


def rolls_elsewhere(recipe: Recipe) -> bool:
    """True where a recipe wants the rollouts of a training made by other machines, where there are any."""
    return recipe.execution.rollout_actors is not None


def train(
    job: Job,
    training: "Training",
    checkpoint_every: int,
    note: Callable[[Mapping[str, float]], str],
) -> "Curves":
    """Train from the job's checkpoint, from its predecessor's end, or from scratch; returns the curves.
    `checkpoint_every`: in updates; `note`: text of an update's metrics. Raises Interrupted, with a checkpoint,
    once a stop is requested, and StageFailed if the state is of another version."""
    from safetensors.numpy import load_file

    from iowbc.learning.checkpoint import load_checkpoint, save_checkpoint
    from iowbc.learning.curves import TABLE, Curves

    path = source = job.work / "training.checkpoint"
    found, origin = load_checkpoint(path, job.key, job.report.say), "resumed from its checkpoint"
    if found is None and job.predecessor is not None:
        source = job.predecessor / STATE
        found, origin = load_file(source), "goes on from a finished training"
        Curves.restore(job.predecessor / TABLE, job.work / CURVES)
    if found is not None:
        try:
            training.restore(found)
        except (KeyError, ValueError) as error:
            remedy = "go on with that version, or remove its folder to train anew"
            raise StageFailed(f"{source}: written by another version of iowbc ({error}); {remedy}") from error
        job.report.say(f"{origin} at {training.steps:,} of {training.planned:,} steps")
    curves = Curves(job.work / CURVES, training.steps)
    updates = 0
    while (before := training.steps) < training.planned:
        began = time.monotonic()
        values = training.update()
        values["steps_per_second"] = (training.steps - before) / (time.monotonic() - began)
        curves.append(training.steps, values)
        job.report.metrics(values, training.steps)
        job.report.progress(min(training.steps, training.planned), training.planned, note(values))
        updates += 1
        stop = job.interrupted()
        if stop or updates % checkpoint_every == 0 or training.steps >= training.planned:
            save_checkpoint(path, job.key, training.arrays())
        if stop:
            raise Interrupted(f"stopped at {training.steps:,} of {training.planned:,} steps, checkpoint written")
    return curves


def leave_extendable(job: Job, training: "Training") -> None:
    """Write the final state of a training, from which a longer one can continue."""
    import numpy as np
    from safetensors.numpy import save_file

    arrays = {name: np.ascontiguousarray(value) for name, value in training.arrays().items()}
    save_file(arrays, job.out / STATE)
