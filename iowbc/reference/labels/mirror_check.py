"""How symmetric the labels are: mirrored samples against the mirror image of their originals' labels."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.reference.labels.dataset import Dataset
from iowbc.reference.labels.plan import SamplePlan
from iowbc.robot.description import Robot
from iowbc.robot.mirror import support_mirror

Array = NDArray[Any]


def mirror_error(robot: Robot, plan: SamplePlan, dataset: Dataset) -> Array | None:
    """Largest joint difference of each pair, shape (pairs,) [rad]; None without pairs."""
    row = {int(index): place for place, index in enumerate(dataset.index)}
    images = [index for index in row if plan.original <= index < plan.drawn and plan.group(index) in row]
    if not images:
        return None
    own = dataset.support[[row[index] for index in images]]
    source = dataset.support[[row[plan.group(index)] for index in images]]
    error: Array = np.abs(support_mirror(robot)(source) - own).max(axis=1)
    return error
