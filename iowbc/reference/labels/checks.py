"""Comparisons of labels: static ones with optimal control, mirrored samples with their originals."""

from dataclasses import dataclass

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.dataset import Dataset, Shard
from iowbc.reference.labels.plan import SamplePlan
from iowbc.robot.mirror import support_mirror

WORST = 5


@dataclass(frozen=True)
class MethodComparison:
    """Differences between static labels and optimal control."""

    difference: Array
    """Largest joint difference of each sample, shape (n,) [rad]."""
    metrics: dict[str, float]
    worst: list[str]


def chosen_for_crosscheck(dataset: Dataset, plan: SamplePlan, recipe: ReferenceGenerator) -> list[int]:
    """Numbers of the drawn samples to solve again, spread evenly over the kept ones."""
    drawn = dataset.index[dataset.index < plan.drawn]
    count = min(recipe.crosscheck.samples, len(drawn))
    return [int(drawn[place]) for place in np.linspace(0, len(drawn) - 1, count).astype(int)] if count else []


def compare_methods(dataset: Dataset, again: Shard) -> MethodComparison | None:
    """Differences where optimal control has a label too; None where it has none."""
    if not len(again.kept):
        return None
    row = {int(index): place for place, index in enumerate(dataset.index)}
    rows = [row[int(index)] for index in again.kept]
    difference = np.abs(dataset.support[rows] - again.labels["support"]).max(axis=1)
    metrics = {
        "crosscheck_samples": float(len(difference)),
        "crosscheck_solved": len(difference) / (len(again.kept) + len(again.rejected)),
        "crosscheck_median": float(np.median(difference)),
        "crosscheck_p90": float(np.percentile(difference, 90)),
        "crosscheck_max": float(difference.max()),
    }
    worst = [
        f"number {again.kept[i]} (height {dataset.command[rows[i], 0]:.3f} m, "
        f"pitch {dataset.command[rows[i], 1]:+.3f} rad): {difference[i]:.4f} rad"
        for i in np.argsort(-difference)[:WORST]
    ]
    return MethodComparison(difference, metrics, worst)


def mirror_error(plan: SamplePlan, dataset: Dataset) -> Array | None:
    """Largest joint difference of mirrored samples from mirror images of their originals, (pairs,) [rad], if any."""
    row = {int(index): place for place, index in enumerate(dataset.index)}
    images = [index for index in row if plan.original <= index < plan.drawn and plan.group(index) in row]
    if not images:
        return None
    own = dataset.support[[row[index] for index in images]]
    source = dataset.support[[row[plan.group(index)] for index in images]]
    return np.abs(support_mirror(plan.robot)(source) - own).max(axis=1)
