"""Vector environments for tests, closed when the test ends."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from changes import with_changes

from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot, load_robot, robot_folder
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv


@pytest.fixture(scope="session")
def folder() -> Path:
    return robot_folder("g1")


@pytest.fixture(scope="session")
def robot(folder: Path) -> Robot:
    return load_robot(folder)


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    """Short episodes, everything random, half of the environments without an object."""
    changes = {"task.episode_duration": (0.3, 2.0), "task.scenes.free": 0.5, "task.scenes.lift": 0.5}
    return with_changes(Recipe(name="test"), changes)


@pytest.fixture
def make(recipe: Recipe, folder: Path) -> Iterator[Callable[..., VectorEnv]]:
    """Makes vector environments; `changes` to the recipe by dotted path."""
    made: list[VectorEnv] = []

    def maker(num_envs: int = 4, workers: int = 0, seed: int = 7, changes: Any = None, **options: Any) -> VectorEnv:
        world = with_changes(recipe, changes or {})
        env = VectorEnv(Specification(world, folder), num_envs=num_envs, workers=workers, seed=seed, **options)
        made.append(env)
        return env

    yield maker
    for env in made:
        env.close()


@pytest.fixture
def opened(folder: Path) -> Iterator[Callable[..., VectorEnv]]:
    """Opens two environments of a recipe."""
    made: list[VectorEnv] = []

    def maker(recipe: Recipe, workers: int = 0, **options: Any) -> VectorEnv:
        made.append(VectorEnv(Specification(recipe, folder), num_envs=2, workers=workers, seed=1, **options))
        made[-1].reset()
        return made[-1]

    yield maker
    for env in made:
        env.close()
