"""Preparation of the dataset for the fit: task Jacobians, splits by group, mirror images."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.errors import Interrupted
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.fit.fitting import FitData
from iowbc.reference.fit.task_error import TaskKinematics
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.support_model import Sample, SupportModel
from iowbc.robot.description import Robot
from iowbc.robot.mirror import interaction_mirror, support_mirror


@dataclass(frozen=True)
class Prepared:
    """The dataset, split."""

    train: FitData
    validation: FitData
    training: Indices
    """Rows of the dataset for training, without mirror images."""
    held_out: Indices
    """Rows of the dataset kept for the gates."""
    samples: list[Sample]
    """All rows as samples."""
    kinematics: TaskKinematics


def prepare(
    dataset: Dataset, robot: Robot, recipe: ReferenceGenerator, seed: int, interrupted: Callable[[], bool]
) -> Prepared:
    """Splits by group and adds mirror images to the training part. Raises `Interrupted`."""
    kinematics = TaskKinematics(SupportModel(robot, recipe.problem, recipe.height))
    samples = [Sample(*row) for row in zip(dataset.arm, dataset.command, strict=True)]
    orientation = np.roll(dataset.base_quaternion, -1, axis=1)
    configuration = np.concatenate([dataset.base_position, orientation, dataset.support], axis=1)
    jacobian = np.empty((len(dataset), 10, len(robot.support)), dtype=np.float32)
    for row, (sample, q) in enumerate(zip(samples, configuration, strict=True)):
        jacobian[row] = kinematics.jacobian(sample, q)
        if row % 1000 == 0 and interrupted():
            raise Interrupted
    train, validation, held_out = split_by_group(dataset.group, recipe.fit.validation, recipe.fit.held_out, seed)
    whole = FitData(np.concatenate([dataset.arm, dataset.command], axis=1), dataset.support, jacobian)
    learnt, checked = (FitData(*(values[rows] for values in whole)) for rows in (train, validation))
    if recipe.fit.mirror:
        arms, legs = interaction_mirror(robot), support_mirror(robot)
        inputs = np.concatenate([arms(dataset.arm[train]), dataset.command[train]], axis=1)
        image = FitData(inputs, legs(dataset.support[train]), legs(jacobian[train]))
        learnt = FitData(*map(np.concatenate, zip(learnt, image, strict=True)))
    return Prepared(learnt, checked, train, held_out, samples, kinematics)


def split_by_group(group: Array, validation: float, held_out: float, seed: int) -> tuple[Indices, Indices, Indices]:
    """Rows for training, early stopping and the gates; rows of one group stay together, no part is empty."""
    groups = np.random.default_rng(seed).permutation(np.unique(group))
    count = len(groups)
    held, checked = max(int(held_out * count), 1), max(int(validation * count), 1)
    if held + checked >= count:
        raise ValueError(
            f"{count} independent samples are too few to split (held out {held}, validation {checked}); "
            "raise rg.sampling.samples"
        )
    parts = groups[held + checked :], groups[held : held + checked], groups[:held]
    train, stop, gate = (np.flatnonzero(np.isin(group, part)) for part in parts)
    return train, stop, gate
