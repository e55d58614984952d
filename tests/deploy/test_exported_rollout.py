"""The exported controller in the simulation, step by step beside the student in the process."""

from dataclasses import fields
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from iowbc.control.sensors import Measured
from iowbc.deploy.controller import open_session, run
from iowbc.deploy.exported_folder import SETTLE, STEP
from iowbc.evaluation.exported import ExportedPolicy
from iowbc.evaluation.trials.plan import command_script, planned_episode
from iowbc.evaluation.trials.rollout import play_in
from iowbc.export.golden import played, stacked
from iowbc.export.graph import ControllerGraph
from iowbc.learning.acting import StudentPolicy
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

TOLERANCE = 1e-5
SEQUENCE = (
    Segment(duration=0.4, ramp=0.0),
    Segment(duration=0.8, velocity=(0.4, 0.0, 0.2), height=0.7, pitch=0.2, wrists=(0.02, 0, 0.03, 0.02, 0, 0.03)),
    Segment(duration=0.6),
)


class Both:
    """The exported controller drives; the student says what it would have done."""

    def __init__(self, exported: ExportedPolicy, student: StudentPolicy) -> None:
        self.exported, self.student = exported, student
        self.differences: list[float] = []

    def reset(self, which: NDArray[np.bool_]) -> None:
        self.exported.reset(which)
        self.student.reset(which)

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        action = self.exported.act(observation, privileged)
        self.differences.append(float(np.abs(action - self.student.act(observation, privileged)).max()))
        return action


@pytest.fixture(scope="module")
def driven(recipe: Recipe, robot: Robot, rg: Path, graph: ControllerGraph, exported: Path) -> Both:
    script = command_script(SEQUENCE, recipe.task.commands)
    episodes = tuple(
        planned_episode(scene, script, mass, 3, {}) for scene, mass in (("lift", 4.0), ("free", 0.0), ("push", 20.0))
    )
    environment = VectorEnv(Specification(recipe, robot.folder, rg), num_envs=3, workers=0, seed=0, episodes=episodes)
    both = Both(ExportedPolicy(exported, environment, golden_steps=80), StudentPolicy(graph.student))
    try:
        play_in(environment, both)
    finally:
        environment.close()
    return both


def test_the_exported_controller_acts_as_the_student_does(driven: Both) -> None:
    assert len(driven.differences) > 50
    assert max(driven.differences) < TOLERANCE


def test_its_targets_are_those_of_the_training_environment(driven: Both) -> None:
    assert driven.exported.largest_difference < TOLERANCE


def test_the_robots_walked(driven: Both) -> None:
    assert (driven.exported.controller.state["phase"] > 0.0).any()
    assert np.abs(driven.exported.controller.state["action"]).max() > 0.01


def test_a_rollout_is_what_the_equations_in_float64_compute(
    driven: Both, graph: ControllerGraph, exported: Path
) -> None:
    """The golden rollout walks, turns, bows and reaches; float32 and the graph change nothing worth a word."""
    inputs, equations = stacked(driven.exported.inputs), graph.equations
    assert len(inputs["command"]) == 80
    sessions = (open_session(exported / name) for name in (SETTLE, STEP))
    found = played(*(partial(run, session) for session in sessions), inputs)
    double = {name: value.astype(np.float64) for name, value in inputs.items()}
    state = equations.settle(*(double[name][:1] for name in ("heading", "command", "grasp")))
    equations.policy = lambda history: graph.student(torch.from_numpy(history.astype(np.float32))).numpy()
    seen = [field.name for field in fields(Measured)]
    for row in range(len(inputs["command"])):
        given = {name: value[row : row + 1] for name, value in double.items()}
        scene = {name: given[name] for name in ("command", "grasp", "load")}
        step = equations.step(Measured(**{name: given[name] for name in seen}), **scene, state=state)
        state = step.state
        assert np.abs(step.target - found["target"][row]).max() < TOLERANCE
