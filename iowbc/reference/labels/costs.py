"""Weights of the support joints against the default posture, shared by both labelling methods."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iowbc.recipe.generator import Problem
from iowbc.robot.description import Robot

Array = NDArray[Any]


def posture_weights(robot: Robot, problem: Problem) -> Array:
    """Weight w of ½ w (θ - θ_default)², shape (15,) [1/rad²]: waist, sagittal (axis across the body) or lateral."""
    waist = {body.hinge.name for body in robot.tree.chain(robot.torso, robot.base) if body.hinge is not None}
    hinges = robot.tree.hinges()
    weights = []
    for index in robot.support:
        hinge = hinges[index]
        if hinge.name in waist:
            weights.append(problem.waist_weight)
        elif int(np.argmax(np.abs(hinge.axis))) == 1:
            weights.append(problem.sagittal_weight)
        else:
            weights.append(problem.lateral_weight)
    return np.array(weights)
