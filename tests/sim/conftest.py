"""Simulations for tests: a robot that stands in a carrying posture, with or without its base held in the air."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from changes import changed

from iowbc.control.arms import ArmKinematics
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.robot.description import Robot
from iowbc.sim import world
from iowbc.sim.simulation import Simulation

IMMOVABLE = 1e6
"""Inertia [kg, kg·m²] that leaves a base where it is."""


@pytest.fixture(scope="session")
def carrying(robot: Robot) -> Any:
    """Joint positions of the default posture, grips 0.3 m ahead of the pelvis, 0.32 m apart and 0.12 m above it."""
    arms = ArmKinematics(robot)
    rotation, position = arms.torso_in_heading(np.zeros((1, 3)), np.zeros(1))
    wrists = np.array([[[0.30, 0.16, 0.12], [0.30, -0.16, 0.12]]])
    target = np.einsum("nji,nsj->nsi", rotation, wrists - position[:, None])
    posture = robot.default_position.copy()
    posture[robot.interaction] = arms.solve(posture[None, robot.interaction], target)[0]
    return posture


@pytest.fixture(scope="session")
def calm() -> Recipe:
    """Nothing random: nominal values, no partner, no blows, no noise."""
    recipe = Recipe()
    for path in ("randomization", "partner", "impulses", "pushes", "sensing"):
        recipe = changed(recipe, f"{path}.enabled", False)
    return recipe


@pytest.fixture(scope="session")
def by_hands(calm: Recipe) -> Recipe:
    """The same where an object touches the hands alone, which then bear all of it."""
    recipe: Recipe = changed(calm, "physics.body_contact", "nothing")
    return recipe


@pytest.fixture
def start(robot: Robot, carrying: Any) -> Callable[..., Simulation]:
    """Makes a simulation and resets it into the carrying posture."""

    def make(recipe: Recipe, scenes: Sequence[str], envs: Any = None, seed: Any = 0, **fixed: Any) -> Simulation:
        n = len(scenes)
        indices = np.arange(n) if envs is None else np.asarray(envs)
        simulation = Simulation(robot, recipe, envs=indices, seed=seed, scenes=scenes, fixed=fixed)
        simulation.reset(np.arange(n), np.tile(carrying, (n, 1)))
        return simulation

    return make


@pytest.fixture
def hold_base(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Makes bases immovable in simulations made from now on; with `vertical_free` only up and down is left."""

    def hold(*, vertical_free: bool = False) -> None:
        compiled = world.compile_scene

        def held(*arguments: Any) -> Any:
            model = compiled(*arguments)
            model.dof_armature[[0, 1, 3, 4, 5] if vertical_free else [0, 1, 2, 3, 4, 5]] = IMMOVABLE
            return model

        monkeypatch.setattr(world, "compile_scene", held)

    return hold
