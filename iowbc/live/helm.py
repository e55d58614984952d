"""Commands that somebody gives while an episode runs, where a trial has its script."""

import numpy as np

from iowbc.arrays import Array, Indices, Keys
from iowbc.control.command import VELOCITY
from iowbc.task.commands.commander import Commander
from iowbc.task.commands.drawing import nominal_command
from iowbc.task.commands.script import CommandScript, CommandSegment
from iowbc.task.memory import Memory
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv


class Helm(Commander):
    """Steers the one environment of a vector environment: what is `wanted` is approached at the recipe's rates and
    clamped to what is feasible, as every command is."""

    def __init__(self, world: Specification, environment: VectorEnv) -> None:
        """Takes over from the environment's own commander."""
        task, guidance = world.recipe.task, environment.batch.guidance
        kinds = [getattr(world.recipe.simulation.scenes, name).kind for name in environment.batch.scenes]
        self.wanted = nominal_command(task.commands)
        """The command to approach, (11,)."""
        super().__init__(
            task,
            guidance.references,
            [CommandScript((CommandSegment(environment.period, tuple(self.wanted)),))],
            np.array([kind == "lift" for kind in kinds]),
            np.array([kind == "push" for kind in kinds]),
            environment.period,
        )
        guidance.commander = self

    def start(self, which: Indices, memory: Memory, key: Keys) -> None:
        """Begins in the wanted posture, standing."""
        super().start(which, memory, key)
        memory.command[which, VELOCITY] = 0.0

    def _scripted(self, memory: Memory) -> Array:
        return self.wanted[None].copy()
