"""The trial that accepts an exported controller: it, not the torch student, carries the load in the simulation."""

from collections.abc import Callable
from pathlib import Path

from iowbc.deploy.controller import Controller
from iowbc.evaluation.exported import ExportedPolicy
from iowbc.evaluation.trials.outcome import Outcome
from iowbc.evaluation.trials.plan import UNDISTURBED, Trial, command_script, trials_at
from iowbc.evaluation.trials.rollout import play_in
from iowbc.recipe.evaluation import Segment
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv


def acceptance_trials(recipe: Recipe) -> list[Trial]:
    """The trials of `export.acceptance`; without it one that stands, unloaded, long enough for the golden vectors."""
    settings, commands = recipe.export, recipe.task.commands
    if settings.acceptance is None:
        duration = settings.golden_steps / recipe.task.control_frequency
        script = command_script([Segment(duration=duration, ramp=0.0)], commands)
        return trials_at("golden", FREE, 0.0, script, count=1, seed=recipe.seed, fixed=UNDISTURBED)
    asked = settings.acceptance
    script = command_script(asked.sequence, commands)
    fixed = UNDISTURBED | {"partner_share": asked.partner_share}
    return trials_at("acceptance", asked.scene, asked.mass, script, count=asked.trials, seed=asked.seed, fixed=fixed)


def try_out(
    recipe: Recipe, robot: Path, rg: Path | None, exported: Path, interrupted: Callable[[], bool]
) -> tuple[ExportedPolicy, list[Outcome]]:
    """Let the controller in the folder `exported` play the trials. Raises Interrupted when interrupted.

    Returns the driver, which holds the golden vectors and the difference of targets, and how the trials went.
    """
    episodes = [trial.episode for trial in acceptance_trials(recipe)]
    controller = Controller.load(exported, robots=len(episodes))
    environment = VectorEnv(
        Specification(recipe, robot, rg), num_envs=len(episodes), workers=0, seed=0, episodes=tuple(episodes)
    )
    try:
        policy = ExportedPolicy(controller, environment, golden_steps=recipe.export.golden_steps)
        outcomes = play_in(environment, recipe, policy, interrupted)
    finally:
        environment.close()
    return policy, outcomes
