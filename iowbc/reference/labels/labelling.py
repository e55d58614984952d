"""Labeller of a worker process: samples by number, posture, gates."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.gates import LabelChecker
from iowbc.reference.labels.gauss_newton import StaticMethod
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.labels.support_model import Sample, SupportModel
from iowbc.robot.description import load_robot


@dataclass(frozen=True)
class LabelTask:
    """Specification from which a worker process builds its labeller."""

    robot: Path
    recipe: ReferenceGenerator
    seed: int
    method: Literal["static", "ocp"]

    def prepare(self) -> "Labeller":
        """Builds the models; called once in each worker."""
        return Labeller(self)


class Labeller:
    """Draws samples by their numbers, and solves and checks them one at a time."""

    def __init__(self, task: LabelTask) -> None:
        robot, recipe = load_robot(task.robot), task.recipe
        self.draw = SamplePlan(robot, recipe, task.seed).draw
        support = SupportModel(robot, recipe.problem, recipe.height)
        self.judge = LabelChecker(support, recipe.gates)
        if task.method == "ocp":  # crocoddyl is loaded only where it is used
            from iowbc.reference.labels.optimal_control import OptimalControlMethod

            self.method: StaticMethod | OptimalControlMethod = OptimalControlMethod(support, recipe)
        else:
            self.method = StaticMethod(support)

    def solve(self, index: int, sample: Sample) -> dict[str, Array]:
        """A label that passed every gate, as arrays named as in the dataset. Raises `Rejected`."""
        self.judge.arms(sample)
        posture = self.method.solve(sample)
        return {
            "support": posture.support,
            "base_position": posture.configuration[:3],
            "base_quaternion": np.roll(posture.configuration[3:7], 1),
            "wrench": posture.wrench,
            **self.judge.label(sample, posture),
        }
