"""The graph of an untrained policy, and its exported folder."""

from collections.abc import Callable
from pathlib import Path

import pytest
from exported_policies import exported, graph, recipe, rg, untrained

from iowbc.export.graph import ControllerGraph
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot

__all__ = ["exported", "graph", "make_graph", "recipe", "rg"]


@pytest.fixture(scope="session")
def make_graph(recipe: Recipe, robot: Robot) -> Callable[[Path | None, bool], ControllerGraph]:
    """Graphs with and without a generator and the object."""
    return lambda rg, observe_object: untrained(recipe, robot, rg, observe_object)
