"""Rollouts of an exported controller in place of the torch student: acceptance trials, golden vectors."""

import itertools
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.deploy.controller import Controller, Values
from iowbc.evaluation.exported import ExportedPolicy
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.evaluation.trials.metrics import trial_metrics
from iowbc.evaluation.trials.plan import UNDISTURBED, command_script, planned_episode
from iowbc.evaluation.trials.rollout import play_episodes, play_in
from iowbc.evaluation.trials.table import carried_along
from iowbc.evaluation.trials.trace import Outcome
from iowbc.learning.acting import Policy
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.export import Acceptance
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.robot.description import Robot, load_robot
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

TINY = 1e-9
"""No error is smaller, in its unit, where errors are compared in parts of each other."""

GOLDEN_PARTS: tuple[dict[str, Any], ...] = (
    {},
    {"velocity": (0.3, 0.1, 0.3)},
    {"velocity": (-0.2, 0.0, 0.0), "height": 0.66},
    {"height": 0.66, "pitch": 0.3, "wrists": (0.03, 0.02, 0.02, 0.03, -0.02, 0.02)},
)
"""Commands of the equal parts of the rollout whose inputs become the golden vectors, in the terms of a segment."""
RAMP = 0.5
"""Part of each over which the command moves."""


@dataclass(frozen=True)
class Accepted:
    """Result of the trials of one `export.acceptance`."""

    asked: Acceptance
    survived: int
    """Trials without a fall or a drop."""
    passed: int
    """Of these, the trials with the weight in the hands and the way covered."""
    weight_in_hands: float
    """Mean part of the weight that rested in the hands; NaN where nothing is held."""
    transport: float
    """Mean part of the commanded way that the robot covered; NaN where none was commanded."""
    errors: Array
    """Means over the trials of the paper's four errors, (4,)."""

    @property
    def enough(self) -> bool:
        """True where as many trials passed as the recipe asks for."""
        return self.passed >= self.asked.minimum

    @property
    def sentence(self) -> str:
        """The request and its result in words."""
        asked, last = self.asked, sum(segment.duration for segment in self.asked.sequence)
        held = "" if np.isnan(self.weight_in_hands) else f", {self.weight_in_hands:.0%} of its weight in the hands"
        way = "" if np.isnan(self.transport) else f", {self.transport:.0%} of the way covered"
        return (
            f"the exported controller kept a {asked.mass:g} kg object ({asked.scene}) for {last:g} s "
            f"in {self.survived} of {asked.trials} trials{held}{way}; {self.passed} passed"
        )

    def differs_from(self, other: "Accepted") -> float:
        """The largest difference of an error from that of other trials, in parts of theirs."""
        return float(np.max(np.abs(self.errors - other.errors) / np.maximum(other.errors, TINY)))


def acceptance_episodes(recipe: Recipe) -> list[Episode]:
    """The trials of `export.acceptance`; without any, one that stands, unloaded, for as long as the golden vectors."""
    settings, commands = recipe.export, recipe.task.commands
    if not settings.acceptance:
        duration = settings.golden_steps / recipe.task.control_frequency
        script = command_script([Segment(duration=duration, ramp=0.0)], commands)
        return [planned_episode(FREE, script, 0.0, recipe.seed, UNDISTURBED)]
    found = []
    for asked in settings.acceptance:
        script, fixed = command_script(asked.sequence, commands), UNDISTURBED | {"partner_share": asked.partner_share}
        seeds = range(asked.seed, asked.seed + asked.trials)
        found += [planned_episode(asked.scene, script, asked.mass, seed, fixed) for seed in seeds]
    return found


def try_out(
    world: Specification, exported: Path, interrupted: Callable[[], bool]
) -> tuple[ExportedPolicy, list[Accepted]]:
    """Let the controller in the folder `exported` play the trials. Raises Interrupted when interrupted.

    Returns the driver, which holds the difference of targets, and how the trials went.
    """
    episodes = acceptance_episodes(world.recipe)
    with closing(VectorEnv(world, num_envs=len(episodes), workers=0, seed=0, episodes=episodes)) as environment:
        policy = ExportedPolicy(Controller.load(exported, robots=len(episodes)), environment)
        return policy, _each_judged(world, episodes, play_in(environment, policy, interrupted))


def try_out_network(world: Specification, policy: Policy, interrupted: Callable[[], bool]) -> list[Accepted]:
    """Let the policy that was exported play the same trials, as it was trained. Raises Interrupted when interrupted."""
    episodes = acceptance_episodes(world.recipe)
    return _each_judged(world, episodes, play_episodes(world, episodes, policy, workers=0, interrupted=interrupted))


def _each_judged(world: Specification, episodes: list[Episode], outcomes: list[Outcome]) -> list[Accepted]:
    """The result of each `export.acceptance`."""
    trials, robot = iter(zip(episodes, outcomes, strict=True)), load_robot(world.robot)
    asked = world.recipe.export.acceptance
    return [judged(world.recipe, robot, one, list(itertools.islice(trials, one.trials))) for one in asked]


def judged(recipe: Recipe, robot: Robot, asked: Acceptance, trials: list[tuple[Episode, Outcome]]) -> Accepted:
    """The trials that pass: survived, weight in the hands, object not lost, way covered."""
    metrics = [trial_metrics(recipe, robot, episode, outcome) for episode, outcome in trials]
    survived = [outcome.survived for _, outcome in trials]
    return Accepted(
        asked,
        survived=sum(survived),
        passed=sum(alive and carried_along(asked, one) for alive, one in zip(survived, metrics, strict=True)),
        weight_in_hands=float(np.mean([one["weight_in_hands"] for one in metrics])),
        transport=float(np.mean([one["transport_robot"] for one in metrics])),
        errors=np.mean([[one[name] for name in ERRORS] for one in metrics], axis=0),
    )


def golden_episode(recipe: Recipe) -> Episode:
    """An undisturbed episode without an object that lasts `export.golden_steps`."""
    duration = recipe.export.golden_steps / recipe.task.control_frequency / len(GOLDEN_PARTS)
    sequence = [
        Segment.model_validate({"duration": duration, "ramp": RAMP * duration, **part}) for part in GOLDEN_PARTS
    ]
    return planned_episode(FREE, command_script(sequence, recipe.task.commands), 0.0, recipe.seed, UNDISTURBED)


def golden_inputs(world: Specification, exported: Path, interrupted: Callable[[], bool]) -> list[Values]:
    """The inputs of each control step, without the state; fewer than asked for where the robot falls.

    Raises Interrupted.
    """
    steps, episodes = world.recipe.export.golden_steps, (golden_episode(world.recipe),)
    with closing(VectorEnv(world, num_envs=1, workers=0, seed=0, episodes=episodes)) as environment:
        policy = ExportedPolicy(Controller.load(exported), environment, golden_steps=steps)
        play_in(environment, policy, interrupted)
    return policy.inputs
