"""The trial that accepts an exported controller: it, not the torch student, carries the load in the simulation."""

from collections.abc import Callable
from pathlib import Path

from iowbc.deploy.controller import Controller
from iowbc.evaluation.exported import ExportedPolicy
from iowbc.evaluation.trials.outcome import Outcome
from iowbc.evaluation.trials.plan import UNDISTURBED, Condition, command_script
from iowbc.evaluation.trials.rollout import play_in
from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv


def acceptance_episodes(recipe: Recipe) -> list[Episode]:
    """The trials of `export.acceptance`; without it one that stands, unloaded, long enough for the golden vectors."""
    settings, commands = recipe.export, recipe.task.commands
    if settings.acceptance is None:
        duration = settings.golden_steps / recipe.task.control_frequency
        script = command_script([Segment(duration=duration, ramp=0.0)], commands)
        return [Condition(FREE, script, UNDISTURBED).episode(0.0, recipe.seed)]
    asked = settings.acceptance
    fixed = UNDISTURBED | {"partner_share": asked.partner_share}
    condition = Condition(asked.scene, command_script(asked.sequence, commands), fixed)
    return [condition.episode(asked.mass, asked.seed + number) for number in range(asked.trials)]


def try_out(
    world: Specification, exported: Path, interrupted: Callable[[], bool]
) -> tuple[ExportedPolicy, list[Outcome]]:
    """Let the controller in the folder `exported` play the trials. Raises Interrupted when interrupted.

    Returns the driver, which holds the golden vectors and the difference of targets, and how the trials went.
    """
    episodes = acceptance_episodes(world.recipe)
    controller = Controller.load(exported, robots=len(episodes))
    environment = VectorEnv(world, num_envs=len(episodes), workers=0, seed=0, episodes=episodes)
    try:
        policy = ExportedPolicy(controller, environment, golden_steps=world.recipe.export.golden_steps)
        outcomes = play_in(environment, policy, interrupted)
    finally:
        environment.close()
    return policy, outcomes
