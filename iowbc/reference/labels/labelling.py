"""Labeller of a worker process: samples by number, posture, gates."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np

from iowbc.arrays import Array, Indices
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.gates import LabelChecker
from iowbc.reference.labels.plan import SamplePlan
from iowbc.reference.labels.sample import Sample
from iowbc.reference.labels.static import StaticMethod
from iowbc.reference.labels.support_model import SupportModel
from iowbc.robot.description import load_robot


class Solver(Protocol):
    """Draws samples and labels them one at a time, in a worker process."""

    def draw(self, indices: Indices) -> list[Sample]:
        """The samples of these numbers."""

    def solve(self, index: int, sample: Sample) -> dict[str, Array]:
        """Arrays of one label, the same shapes for every sample. Raises `Rejected` with a reason."""


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
    """Draws, solves and checks samples."""

    def __init__(self, task: LabelTask) -> None:
        robot, recipe = load_robot(task.robot), task.recipe
        self.draw = SamplePlan(robot, recipe, task.seed).draw
        support = SupportModel(robot, recipe.problem)
        self.judge = LabelChecker(support, recipe.gates, recipe.height)
        if task.method == "ocp":  # crocoddyl is loaded only where it is used
            from iowbc.reference.labels.optimal_control import OptimalControlMethod

            self.method: StaticMethod | OptimalControlMethod = OptimalControlMethod(support, recipe)
        else:
            self.method = StaticMethod(support, recipe.height)

    def solve(self, index: int, sample: Sample) -> dict[str, Array]:
        """A label that passed every gate, as arrays named as in the dataset. Raises `Rejected`."""
        self.judge.arms(sample)
        posture = self.method.solve(sample)
        evidence = self.judge.label(sample, posture)
        return {
            "support": posture.support,
            "base_position": posture.configuration[:3],
            "base_quaternion": np.roll(posture.configuration[3:7], 1),
            "wrench": posture.wrench,
            "torque": evidence.torque,
            "margin": np.asarray(evidence.margin),
            "reached": np.asarray(evidence.height),
        }
