"""Exported controllers in simulation: as policies that read the sensors, acceptance trials, golden vectors."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from iowbc.arrays import Array
from iowbc.control.references import ReferenceLayer
from iowbc.deploy import contract, exported_folder
from iowbc.deploy.controller import Controller, Values
from iowbc.errors import ContractBroken
from iowbc.evaluation.trials.errors import ERRORS
from iowbc.evaluation.trials.metrics import transported, trial_metrics
from iowbc.evaluation.trials.plan import UNDISTURBED, command_script, planned_episode
from iowbc.evaluation.trials.rollout import Outcome, play_in, playing
from iowbc.learning.acting import Policy
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.export import Acceptance
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.holding import FREE
from iowbc.robot.description import Robot, load_robot
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

Acting = TypeVar("Acting", bound=Policy)
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


def exported_world(folder: Path) -> Specification:
    """Specification with which an exported controller was accepted, from its folder alone. Raises ContractBroken if the
    folder does not match its contract."""
    controller = Controller.load(folder)
    said = controller.contract
    contract.require_sealed(said.files, folder / exported_folder.CONTRACT, exported_folder.RECIPE)
    path = folder / exported_folder.RECIPE
    try:
        recipe = Recipe.model_validate_json(path.read_bytes())
    except ValidationError as error:
        raise ContractBroken(f"{path}: not a recipe of this version: {error}; export again") from error
    generator = contract.generator_folder(said, folder)
    with contract.readable(folder / exported_folder.GENERATOR):
        ReferenceLayer(controller.robot, recipe.task.references, generator)
    with contract.readable(folder):
        return Specification(recipe.deployed, folder / exported_folder.ROBOT, generator)


class ExportedPolicy:
    """Exported controller as the policy of an in-process vector environment. `largest_difference`: of its joint targets
    from those that the environment computes from the action [rad]; it covers arm kinematics, reference generator, gait
    clock and scaling."""

    def __init__(self, folder: Path, environment: VectorEnv, *, golden_steps: int = 0) -> None:
        """`golden_steps`: number of steps of the first environment to keep as golden vectors."""
        self.controller, self.environment = Controller.load(folder, robots=environment.num_envs), environment
        self.golden_steps = golden_steps
        self.inputs: list[Values] = []
        self.largest_difference = 0.0

    def reset(self, which: NDArray[np.bool_]) -> None:
        scenes = self.environment.batch.scenes
        for scene in sorted(set(scenes[which])):
            self.controller.reset(which & (scenes == scene), scene=scene)

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        batch = self.environment.batch
        targets = self.controller.step(batch.simulation.measured, batch.memory.command)
        expected = batch.targets(targets.action)
        passed = np.abs(expected - targets.position)[~targets.held]
        self.largest_difference = max(self.largest_difference, float(passed.max(initial=0.0)))
        if len(self.inputs) < self.golden_steps:
            given = self.controller.inputs
            self.inputs.append({name: value[:1].copy() for name, value in given.items() if name != "state"})
        return targets.action


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
    world: Specification, policy_in: Callable[[VectorEnv], Acting], interrupted: Callable[[], bool]
) -> tuple[Acting, list[Accepted]]:
    """Acceptance trials with the policy that `policy_in` makes for an environment: the policy, and the result of each
    `export.acceptance`. Raises Interrupted when interrupted."""
    recipe, robot, episodes = world.recipe, load_robot(world.robot), acceptance_episodes(world.recipe)
    with playing(world, episodes) as environment:
        policy = policy_in(environment)
        trials = iter(zip(episodes, play_in(environment, policy, interrupted), strict=True))
    asked = recipe.export.acceptance
    return policy, [judged(recipe, robot, one, list(itertools.islice(trials, one.trials))) for one in asked]


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
        policy = ExportedPolicy(exported, environment, golden_steps=world.recipe.export.golden_steps)
        play_in(environment, policy, interrupted)
    return policy.inputs
