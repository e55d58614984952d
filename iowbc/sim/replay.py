"""Plays again the control period in which a simulation diverged."""

import numpy as np

from iowbc.recipe.simulation.simulation import Simulation as Recipe
from iowbc.robot.description import Robot
from iowbc.sim.divergence import Divergence
from iowbc.sim.world import World


def recorded_world(robot: Robot, recipe: Recipe, divergence: Divergence, substeps: int) -> World:
    """A world of one simulation, in the state at the start of the recorded period."""
    scene = getattr(recipe.scenes, divergence.scene)
    world = World(robot, recipe.physics, scene, np.zeros(1, np.int64), substeps)
    world.recall(0, divergence.arrays)
    return world


def replay(robot: Robot, recipe: Recipe, divergence: Divergence, substeps: int) -> bool:
    """Whether the recorded period diverges again; it does, with the same physics and robot."""
    world, arrays = recorded_world(robot, recipe, divergence, substeps), divergence.arrays
    diverged = np.zeros(1, bool)
    world.step(arrays["target"][None], arrays["wrench"][None], arrays["push"][None], diverged)
    return bool(diverged[0])
