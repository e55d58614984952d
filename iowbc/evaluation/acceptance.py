"""Rollouts of an exported controller in place of the torch student: acceptance trials, golden vectors."""

import itertools
from collections.abc import Callable
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
from iowbc.evaluation.trials.rollout import Outcome, play_episodes, play_in, playing
from iowbc.evaluation.trials.table import transported
from iowbc.learning.acting import Policy
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.export import Acceptance
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.robot.description import Robot, load_robot
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification

TINY = 1e-9
"""Lower bound of an error, in its unit, as denominator of a relative difference."""

GOLDEN_PARTS: tuple[dict[str, Any], ...] = (
    {},
    {"velocity": (0.3, 0.1, 0.3)},
    {"velocity": (-0.2, 0.0, 0.0), "height": 0.66},
    {"height": 0.66, "pitch": 0.3, "wrists": (0.03, 0.02, 0.02, 0.03, -0.02, 0.02)},
)
"""Commands of the rollout that gives the golden vectors: fields of segments of equal duration."""
RAMP = 0.5
"""Fraction of each segment over which the command changes."""


@dataclass(frozen=True)
class Accepted:
    """Result of the trials of one `export.acceptance`."""

    asked: Acceptance
    survived: int
    """Trials without a fall or a drop."""
    passed: int
    """Survived trials with the weight in the hands and the distance covered."""
    weight_in_hands: float
    """Mean fraction of the weight in the hands; NaN if nothing is held."""
    transport: float
    """Mean fraction of the commanded distance that the robot covered; NaN if none was commanded."""
    errors: Array
    """Means over the trials of the paper's four errors, (4,)."""

    @property
    def enough(self) -> bool:
        return self.passed >= self.asked.minimum

    @property
    def sentence(self) -> str:
        """Acceptance criterion and result in words."""
        asked, last = self.asked, sum(segment.duration for segment in self.asked.sequence)
        held = "" if np.isnan(self.weight_in_hands) else f", {self.weight_in_hands:.0%} of its weight in the hands"
        way = "" if np.isnan(self.transport) else f", {self.transport:.0%} of the way covered"
        return (
            f"the exported controller kept a {asked.mass:g} kg object ({asked.scene}) for {last:g} s "
            f"in {self.survived} of {asked.trials} trials{held}{way}; {self.passed} passed"
        )

    def differs_from(self, other: "Accepted") -> float:
        """Largest relative difference of an error from that of other trials."""
        return float(np.max(np.abs(self.errors - other.errors) / np.maximum(other.errors, TINY)))


def acceptance_episodes(recipe: Recipe) -> list[Episode]:
    """Trials of `export.acceptance`; if empty, one trial of standing without load, `export.golden_steps` long."""
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


def run_acceptance(
    world: Specification, exported: Path, interrupted: Callable[[], bool]
) -> tuple[ExportedPolicy, list[Accepted]]:
    """Acceptance trials with the controller in the folder `exported`: the policy, which holds the largest difference of
    joint targets, and the results. Raises Interrupted when interrupted."""
    episodes = acceptance_episodes(world.recipe)
    with playing(world, episodes) as environment:
        policy = ExportedPolicy(Controller.load(exported, robots=len(episodes)), environment)
        return policy, _each_judged(world, episodes, play_in(environment, policy, interrupted))


def try_out_network(world: Specification, policy: Policy, interrupted: Callable[[], bool]) -> list[Accepted]:
    """Run the acceptance trials with the original trained policy. Raises Interrupted when interrupted."""
    episodes = acceptance_episodes(world.recipe)
    return _each_judged(world, episodes, play_episodes(world, episodes, policy, workers=0, interrupted=interrupted))


def _each_judged(world: Specification, episodes: list[Episode], outcomes: list[Outcome]) -> list[Accepted]:
    """The result of each `export.acceptance`."""
    trials, robot = iter(zip(episodes, outcomes, strict=True)), load_robot(world.robot)
    asked = world.recipe.export.acceptance
    return [judged(world.recipe, robot, one, list(itertools.islice(trials, one.trials))) for one in asked]


def judged(recipe: Recipe, robot: Robot, asked: Acceptance, trials: list[tuple[Episode, Outcome]]) -> Accepted:
    """Result of the trials. A trial passes if survived with weight in the hands, object kept and distance covered."""
    metrics = [trial_metrics(recipe, robot, episode, outcome) for episode, outcome in trials]
    shares = [one["weight_in_hands"] for one in metrics if not np.isnan(one["weight_in_hands"])]
    survived = [outcome.survived for _, outcome in trials]
    return Accepted(
        asked,
        survived=sum(survived),
        passed=sum(alive and transported(asked, one) for alive, one in zip(survived, metrics, strict=True)),
        weight_in_hands=float(np.mean(shares)) if shares else np.nan,
        transport=float(np.mean([one["transport_robot"] for one in metrics])),
        errors=np.mean([[one[name] for name in ERRORS] for one in metrics], axis=0),
    )


def golden_episode(recipe: Recipe) -> Episode:
    """Undisturbed episode of `export.golden_steps` steps without an object."""
    duration = recipe.export.golden_steps / recipe.task.control_frequency / len(GOLDEN_PARTS)
    sequence = [Segment(duration=duration, ramp=RAMP * duration, **part) for part in GOLDEN_PARTS]
    return planned_episode(FREE, command_script(sequence, recipe.task.commands), 0.0, recipe.seed, UNDISTURBED)


def golden_inputs(world: Specification, exported: Path, interrupted: Callable[[], bool]) -> list[Values]:
    """Controller inputs of each control step, without the state; fewer than `export.golden_steps` if the robot falls.
    Raises Interrupted."""
    with playing(world, [golden_episode(world.recipe)]) as environment:
        policy = ExportedPolicy(Controller.load(exported), environment, golden_steps=world.recipe.export.golden_steps)
        play_in(environment, policy, interrupted)
    return policy.inputs
