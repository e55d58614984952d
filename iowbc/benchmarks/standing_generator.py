"""World of a benchmark: one scene, and a reference generator that always stands, at the cost of a fitted one."""

import itertools
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from iowbc.control.feasible_map import FEASIBLE, FeasibleMap
from iowbc.control.generator import ReferenceNetwork, input_names
from iowbc.recipe.generator import ReferenceGenerator
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.task import SceneShares
from iowbc.robot.description import Robot, load_robot, robot_folder
from iowbc.task.specification import Specification


def write_standing_generator(folder: Path, robot: Robot, recipe: ReferenceGenerator) -> None:
    """Writes an artifact like that of `rg-fit`: a network of the recipe's size whose last layer is zero, and a feasible
    map of that one posture."""
    inputs, support = len(input_names(robot, recipe.height)), robot.support
    sizes = (inputs, *recipe.fit.hidden, len(support))
    rng = np.random.default_rng(0)
    weights = [
        rng.normal(scale=size**-0.5, size=(after, size)).astype(np.float32) for size, after in itertools.pairwise(sizes)
    ]
    weights[-1][:] = 0.0
    ReferenceNetwork.of(
        robot,
        recipe.height,
        layers=tuple((weight, np.zeros(len(weight), np.float32)) for weight in weights),
        input_mean=np.zeros(inputs, np.float32),
        input_std=np.ones(inputs, np.float32),
        output_mean=robot.default_position[support].astype(np.float32),
        output_std=np.ones(len(support), np.float32),
    ).save(folder)
    FeasibleMap.single(robot.default_height).save(folder / FEASIBLE)


@contextmanager
def generator_of(robot: Path, recipe: Recipe) -> Iterator[Path]:
    """Temporary folder of a stand-in for a fitted reference generator."""
    with tempfile.TemporaryDirectory() as place:
        write_standing_generator(Path(place), load_robot(robot), recipe.rg)
        yield Path(place)


@contextmanager
def benchmark_world(recipe: Recipe, scene: str) -> Iterator[Specification]:
    """The world of a recipe with a single scene and a stand-in for the generator."""
    only = {"task": recipe.task.model_copy(update={"scenes": SceneShares.only(scene)})}
    recipe, folder = recipe.model_copy(update=only), robot_folder(recipe.robot)
    with generator_of(folder, recipe) as generator:
        yield Specification(recipe, folder, generator)
