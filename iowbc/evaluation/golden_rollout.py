"""The rollout whose inputs become the golden vectors: it stands, walks and turns, and changes height and lean."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from iowbc.deploy.controller import Controller
from iowbc.deploy.session import Values
from iowbc.evaluation.exported import ExportedPolicy
from iowbc.evaluation.trials.plan import UNDISTURBED, Condition, command_script
from iowbc.evaluation.trials.rollout import play_in
from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

PARTS: tuple[dict[str, Any], ...] = (
    {},
    {"velocity": (0.3, 0.1, 0.3)},
    {"velocity": (-0.2, 0.0, 0.0), "height": 0.66},
    {"height": 0.66, "pitch": 0.3, "wrists": (0.03, 0.02, 0.02, 0.03, -0.02, 0.02)},
)
"""Commands of the equal parts of the rollout, in the terms of a segment."""
RAMP = 0.5
"""Part of each over which the command moves."""


def golden_episode(recipe: Recipe) -> Episode:
    """An undisturbed episode without an object that lasts `export.golden_steps`."""
    duration = recipe.export.golden_steps / recipe.task.control_frequency / len(PARTS)
    sequence = [Segment.model_validate({"duration": duration, "ramp": RAMP * duration, **part}) for part in PARTS]
    return Condition(FREE, command_script(sequence, recipe.task.commands), UNDISTURBED).episode(0.0, recipe.seed)


def golden_inputs(world: Specification, exported: Path, interrupted: Callable[[], bool]) -> list[Values]:
    """The inputs of each control step, without the state; fewer than asked for where the robot falls.

    Raises Interrupted.
    """
    steps, episodes = world.recipe.export.golden_steps, (golden_episode(world.recipe),)
    with closing(VectorEnv(world, num_envs=1, workers=0, seed=0, episodes=episodes)) as environment:
        policy = ExportedPolicy(Controller.load(exported), environment, golden_steps=steps)
        play_in(environment, policy, interrupted)
    return policy.inputs
