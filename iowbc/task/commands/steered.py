"""Commands that somebody gives while an episode runs, where a trial has its script."""

from collections.abc import Sequence

import numpy as np

from iowbc.arrays import Array, Indices, Keys
from iowbc.control.command import VELOCITY, nominal_command
from iowbc.recipe.recipe import Recipe
from iowbc.task.commands.commander import Commander
from iowbc.task.commands.script import CommandScript, CommandSegment
from iowbc.task.guidance import Guidance
from iowbc.task.memory import Memory


class SteeredCommander(Commander):
    """What is `wanted` in n environments is approached at the recipe's rates and clamped to what is feasible, as every
    command is. An episode begins in the wanted posture, standing."""

    def __init__(self, recipe: Recipe, guidance: Guidance, scenes: Sequence[str] | Array, period: float) -> None:
        """Takes over from the commander of `guidance`; `scenes`: name of each environment's."""
        kinds = [getattr(recipe.simulation.scenes, name).kind for name in scenes]
        nominal = nominal_command(recipe.task.commands)
        self.wanted = np.tile(nominal, (len(kinds), 1))
        """The commands to approach, (n, 11)."""
        super().__init__(
            recipe.task,
            guidance.references,
            [CommandScript((CommandSegment(period, tuple(nominal)),))] * len(kinds),
            np.array([kind == "lift" for kind in kinds]),
            np.array([kind == "push" for kind in kinds]),
            period,
        )
        guidance.commander = self

    def start(self, which: Indices, memory: Memory, key: Keys) -> None:
        """Begins in the wanted posture, standing."""
        super().start(which, memory, key)
        memory.command[which, VELOCITY] = 0.0

    def _scripted(self, memory: Memory) -> Array:
        return self.wanted.copy()
