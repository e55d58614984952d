"""A small untrained policy and its reference generator, for tests of exporting and of what was exported.

The fixtures are those of every folder of tests whose `conftest.py` imports them.
"""

from pathlib import Path

import numpy as np
import pytest
import torch

from iowbc.control.feasible_map import FeasibleMap
from iowbc.control.generator import ReferenceNetwork
from iowbc.control.observation import ObservationLayout, observation_layout
from iowbc.control.references import ReferenceLayer
from iowbc.deploy.controller import Values
from iowbc.deploy.timing import INPUT
from iowbc.export.folder import write_folder
from iowbc.export.golden import OUTPUT
from iowbc.export.graph import ControllerGraph
from iowbc.learning.networks import StudentNetwork
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot

HISTORY = 25


def read_golden(path: Path) -> tuple[Values, Values]:
    """Inputs and outputs of golden vectors by name."""
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    inputs, outputs = (
        {name.removeprefix(start): value for name, value in arrays.items() if name.startswith(start)}
        for start in (INPUT, OUTPUT)
    )
    return inputs, outputs


def made_up_generator(robot: Robot, folder: Path) -> Path:
    """A generator whose postures are the default one and a little that depends on arms, height and pitch."""
    random = np.random.default_rng(0)
    joints = np.array(robot.joints)
    inputs = (*joints[robot.interaction], "pelvis_height", "torso_pitch")
    network = ReferenceNetwork(
        inputs=inputs,
        outputs=tuple(joints[robot.support]),
        layers=tuple(
            (random.normal(size=(rows, columns)) / columns**0.5, 0.1 * random.normal(size=rows))
            for rows, columns in ((8, len(inputs)), (15, 8))
        ),
        input_mean=np.full(len(inputs), 0.1),
        input_std=np.full(len(inputs), 0.7),
        output_mean=robot.default_position[robot.support],
        output_std=np.full(15, 0.05),
        lower=robot.lower[robot.support],
        upper=robot.upper[robot.support],
    )
    network.save(folder)
    pitch = np.linspace(-0.25, 0.75, 5)
    FeasibleMap(pitch, np.full(5, 0.5), np.full(5, 0.78)).save(folder / "feasible.npz")
    return folder


def untrained(recipe: Recipe, robot: Robot, rg: Path | None, observe_object: bool = True) -> ControllerGraph:
    """The graph of an untrained student."""
    torch.manual_seed(0)
    layout = observation_layout(robot, observe_object)
    student = StudentNetwork(layout.size, HISTORY, 15, 8, 8, [16], "elu", 10.0)
    return graph_of(student, recipe, robot, layout, rg)


def graph_of(
    student: StudentNetwork, recipe: Recipe, robot: Robot, layout: ObservationLayout, rg: Path | None
) -> ControllerGraph:
    """The graph of a student."""
    references = ReferenceLayer(robot, recipe.task.references, rg)
    return ControllerGraph(student, robot, recipe.task, layout, references)


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    references = {"gait": {"recovery": {}, "placement": {"integral": 0.1}, "spread": 0.04}, "torso": {}, "height": {}}
    return Recipe.model_validate(
        {
            "name": "test",
            "task": {"action": {"previous_share": 0.3}, "references": references},
            "export": {"acceptance": [], "golden_steps": 5},
        }
    )


@pytest.fixture(scope="session")
def rg(robot: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_up_generator(robot, tmp_path_factory.mktemp("rg"))


@pytest.fixture(scope="session")
def graph(recipe: Recipe, robot: Robot, rg: Path) -> ControllerGraph:
    return untrained(recipe, robot, rg)


@pytest.fixture(scope="session")
def exported(recipe: Recipe, graph: ControllerGraph, rg: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exported")
    write_folder(folder, graph, recipe, rg, {"rg-fit": "a" * 8})
    return folder
