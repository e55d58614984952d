"""The graph of an untrained policy, and its exported folder."""

from collections.abc import Callable
from pathlib import Path

import pytest
from exported_policies import made_up_generator, untrained

from iowbc.export.folder import write_folder
from iowbc.export.graph import ControllerGraph
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    return Recipe.model_validate({"name": "test", "export": {"acceptance": [], "golden_steps": 5}})


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


@pytest.fixture(scope="session")
def make_graph(recipe: Recipe, robot: Robot) -> Callable[[Path | None, bool], ControllerGraph]:
    """Graphs with and without a generator and the object."""
    return lambda rg, observe_object: untrained(recipe, robot, rg, observe_object)
