"""Which base commands the network takes, as the recipe samples them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.recipe.generator import ReferenceGenerator
from iowbc.robot.description import Robot

Array = NDArray[Any]


def input_names(robot: Robot, recipe: ReferenceGenerator) -> tuple[str, ...]:
    """Arm joints, height, pitch, then torso roll, yaw and the wrists' payloads where they are sampled."""
    sampling = recipe.sampling
    names = [robot.joints[index] for index in robot.interaction]
    names += [f"{recipe.height}_height", "torso_pitch"]
    names += ["torso_roll"] if sampling.roll is not None else []
    names += ["torso_yaw"] if sampling.yaw is not None else []
    names += ["left_payload", "right_payload"] if sampling.payload is not None else []
    return tuple(names)


def base_columns(recipe: ReferenceGenerator, command: Array, payload: Array) -> Array:
    """Those columns, shape (n, 2 to 6), of full commands (n, 4) and payloads (n, 2)."""
    sampling = recipe.sampling
    columns = [command[:, :2]]
    columns += [command[:, 2:3]] if sampling.roll is not None else []
    columns += [command[:, 3:4]] if sampling.yaw is not None else []
    columns += [payload] if sampling.payload is not None else []
    return np.concatenate(columns, axis=1)
