"""Simulations that diverged: state and inputs before it, kept for replay."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Self

import numpy as np

from iowbc.arrays import Array
from iowbc.recipe.simulation.simulation import SimulationSettings as Recipe
from iowbc.robot.description import Robot
from iowbc.sim.state import Period
from iowbc.sim.timing import Timing
from iowbc.sim.world import World


@dataclass(frozen=True)
class Divergence:
    """One environment at the start of the control period in which it diverged."""

    scene: str
    environment: int
    episode: int
    step: int
    arrays: Mapping[str, Array]
    """MuJoCo's state row, the targets and wrenches of the period, and the fields of the environment's own model."""

    def save(self, file: Path) -> None:
        """Writes an .npz without pickles."""
        about = {"scene": self.scene, "environment": self.environment, "episode": self.episode, "step": self.step}
        stored: dict[str, Any] = {"about": np.array(json.dumps(about)), **self.arrays}
        np.savez(file, **stored)

    @classmethod
    def load(cls, file: Path) -> Self:
        with np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files if name != "about"}
            about = json.loads(str(stored["about"]))
        return cls(arrays=arrays, **about)


def replay(robot: Robot, recipe: Recipe, divergence: Divergence, timing: Timing) -> bool:
    """Repeats the recorded period. True if it diverges again, as it does with the same physics and robot."""
    scene, arrays = getattr(recipe.scenes, divergence.scene), divergence.arrays
    world = World(robot, recipe.physics, scene, np.zeros(1, np.int64), timing)
    world.restore({name: values[None] for name, values in arrays.items()})
    diverged = np.zeros(1, bool)
    world.step(Period(**{field.name: arrays[field.name][None] for field in fields(Period)}), diverged)
    return bool(diverged[0])
