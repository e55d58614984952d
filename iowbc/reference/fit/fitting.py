"""Fit of the reference network in torch: joint errors, and their first-order effect on feet, height and torso.

The dataset is prepared first: task Jacobians, splits by group, mirror images.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import torch

from iowbc.arrays import Array, Indices
from iowbc.errors import Interrupted
from iowbc.recipe.generator import Fit, ReferenceGenerator
from iowbc.reference.fit.errors import LENGTH_ROWS, ROWS, task_jacobian
from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.support_model import Sample, SupportModel
from iowbc.robot.description import Robot
from iowbc.robot.mirror import interaction_mirror, support_mirror

SMALLEST_SPREAD = 1e-3
"""Least standard deviation used for normalisation: a constant stays constant."""
FINAL_RATE = 0.01
"""Final learning rate as a fraction of the initial one."""


class FitData(NamedTuple):
    """Inputs (n, inputs), outputs (n, 15) [rad], and the task Jacobians (n, 10, 15) of some samples."""

    inputs: Array
    outputs: Array
    jacobian: Array


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
    support: SupportModel


def prepare(
    dataset: Dataset, robot: Robot, recipe: ReferenceGenerator, seed: int, interrupted: Callable[[], bool]
) -> Prepared:
    """Splits by group and adds mirror images to the training part. Raises `Interrupted`."""
    support = SupportModel(robot, recipe.problem, recipe.height)
    samples = [Sample(*row) for row in zip(dataset.arm, dataset.command, strict=True)]
    orientation = np.roll(dataset.base_quaternion, -1, axis=1)
    configuration = np.concatenate([dataset.base_position, orientation, dataset.support], axis=1)
    jacobian = np.empty((len(dataset), 10, len(robot.support)), dtype=np.float32)
    for row, (sample, q) in enumerate(zip(samples, configuration, strict=True)):
        jacobian[row] = task_jacobian(support, sample, q)
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
    return Prepared(learnt, checked, train, held_out, samples, support)


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


@dataclass(frozen=True)
class Fitted:
    """Weights, normalisation and losses of the fitted network, float32."""

    layers: tuple[tuple[Array, Array], ...]
    input_mean: Array
    input_std: Array
    output_mean: Array
    output_std: Array
    epochs: int
    training_loss: tuple[float, ...]
    validation_loss: tuple[float, ...]


def fit(
    train: FitData,
    validation: FitData,
    recipe: Fit,
    seed: int,
    epoch_done: Callable[[int, float, float], None],
    interrupted: Callable[[], bool],
) -> Fitted:
    """Trains with Adam on |δθ|² + w |J δθ|², lengths in units of `length_scale`; keeps the epoch that validates best.
    One thread and one seeded generator: the result is the same on every run."""
    torch.set_num_threads(1)
    generator = torch.Generator().manual_seed(seed)
    input_mean, input_std = _moments(train.inputs)
    output_mean, output_std = _moments(train.outputs)
    row_scale = np.ones((ROWS, 1))
    row_scale[list(LENGTH_ROWS)] = 1.0 / recipe.length_scale
    spread = torch.from_numpy(output_std)

    def prepared(data: FitData) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        return (
            torch.from_numpy(((data.inputs - input_mean) / input_std).astype(np.float32)),
            torch.from_numpy(((data.outputs - output_mean) / output_std).astype(np.float32)),
            torch.from_numpy((data.jacobian * row_scale * np.sqrt(recipe.task_weight)).astype(np.float32)),
        )

    def loss(x: torch.Tensor, y: torch.Tensor, jacobian: torch.Tensor) -> torch.Tensor:
        error = (network(x) - y) * spread
        task = torch.bmm(jacobian, error.unsqueeze(-1))
        return (error.square().sum() + task.square().sum()) / len(x)

    network = _network([train.inputs.shape[1], *recipe.hidden, train.outputs.shape[1]], generator)
    x, y, jacobian = prepared(train)
    held = prepared(validation)
    count = len(x)
    batches = max(count // recipe.batch, 1)
    optimiser = torch.optim.Adam(network.parameters(), lr=recipe.learning_rate)
    total = recipe.epochs * batches
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimiser, lambda step: FINAL_RATE + (1.0 - FINAL_RATE) * 0.5 * (1.0 + np.cos(np.pi * min(step / total, 1.0)))
    )
    best, best_epoch, kept = np.inf, 0, _numbers(network)
    curves: list[tuple[float, float]] = []
    for epoch in range(1, recipe.epochs + 1):
        if interrupted():
            raise Interrupted
        order = torch.randperm(count, generator=generator)
        summed = 0.0
        for batch in torch.tensor_split(order, batches):
            value = loss(x[batch], y[batch], jacobian[batch])
            optimiser.zero_grad()
            value.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            schedule.step()
            summed += float(value.detach())
        with torch.no_grad():
            checked = float(loss(*held))
        curves.append((summed / batches, checked))
        epoch_done(epoch, *curves[-1])
        if not np.isfinite(checked):
            raise ValueError(f"the fit diverged in epoch {epoch}; lower rg.fit.learning_rate ({recipe.learning_rate})")
        if checked < best:
            best, best_epoch, kept = checked, epoch, _numbers(network)
        if epoch - best_epoch >= recipe.patience:
            break
    training, validated = zip(*curves, strict=True)
    return Fitted(kept, input_mean, input_std, output_mean, output_std, best_epoch, training, validated)


def _moments(values: Array) -> tuple[Array, Array]:
    mean, spread = values.mean(axis=0), np.maximum(values.std(axis=0), SMALLEST_SPREAD)
    return mean.astype(np.float32), spread.astype(np.float32)


def _network(sizes: list[int], generator: torch.Generator) -> torch.nn.Sequential:
    modules: list[torch.nn.Module] = []
    for width_in, width_out in pairwise(sizes):
        layer = torch.nn.Linear(width_in, width_out)
        torch.nn.init.kaiming_uniform_(layer.weight, nonlinearity="linear", generator=generator)
        torch.nn.init.zeros_(layer.bias)
        modules += [layer, torch.nn.ELU()]
    return torch.nn.Sequential(*modules[:-1])


def _numbers(network: torch.nn.Sequential) -> tuple[tuple[Array, Array], ...]:
    layers = [module for module in network if isinstance(module, torch.nn.Linear)]
    return tuple((layer.weight.detach().numpy().copy(), layer.bias.detach().numpy().copy()) for layer in layers)
