"""The world of the games in tests: a small student that knows nothing, on a quiet robot without a generator."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import torch
from changes import with_changes

from iowbc.control.observation import observation_layout
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import load_robot, robot_folder
from iowbc.rollouts.policies import HistoryEncoder, HistoryPolicy, Layers, Linear, Normal
from iowbc.skill.game import TransportGame
from iowbc.skill.lower_layer import Student
from iowbc.task.specification import Specification

HISTORY, WIDTH = 3, 8


@pytest.fixture(scope="session", autouse=True)
def one_thread() -> None:
    """Networks learn on one thread, as in the stages."""
    torch.set_num_threads(1)


@pytest.fixture(scope="session")
def world() -> Specification:
    """Games of at most two seconds on the G1 without a reference generator."""
    recipe = Recipe(name="test")
    changes: dict[str, Any] = {
        f"skill.tasks.{name}": getattr(recipe.skill.tasks, name).model_copy(update={"duration": 2.0})
        for name in recipe.skill.tasks.names
    }
    return Specification(with_changes(recipe, changes), robot_folder("g1"))


@pytest.fixture(scope="session")
def student() -> Student:
    """Small random weights: the joints twitch about their references."""
    robot = load_robot(robot_folder("g1"))
    size, rng = observation_layout(robot, True).size, np.random.default_rng(0)

    def layer(inputs: int, outputs: int) -> Linear:
        weight = 0.02 * rng.normal(size=(inputs, outputs)).astype(np.float32)
        return Linear(weight, np.zeros(outputs, np.float32))

    policy = HistoryPolicy(
        normal=Normal(np.zeros(size, np.float32), np.ones(size, np.float32), 5.0),
        encoder=HistoryEncoder(layer(size, WIDTH), layer(HISTORY * WIDTH, WIDTH), "elu"),
        estimate=None,
        body=Layers((layer(size + WIDTH, WIDTH), layer(WIDTH, len(robot.support))), "elu"),
    )
    return Student(policy, HISTORY, size)


@pytest.fixture
def make(world: Specification, student: Student) -> Iterator[Callable[..., TransportGame]]:
    """Makes games, which are closed when the test ends; `changes` to the recipe by dotted path."""
    made: list[TransportGame] = []

    def maker(n: int = 4, changes: Any = None, **options: Any) -> TransportGame:
        changed = Specification(with_changes(world.recipe, changes or {}), world.robot)
        made.append(TransportGame(changed, student, n=n, **options))
        return made[-1]

    yield maker
    for game in made:
        game.close()
