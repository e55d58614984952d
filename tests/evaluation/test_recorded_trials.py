"""What is recorded of simulated trials: forces, velocities and the metrics that follow from them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from iowbc.evaluation.trials.metrics import trial_row
from iowbc.evaluation.trials.plan import UNDISTURBED, Trial, command_script, planned_episode
from iowbc.evaluation.trials.rollout import Outcome, play_episodes
from iowbc.recipe.evaluation.sequences import Segment
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.robot.description import load_robot, robot_folder
from iowbc.task.episodes import PlannedPull
from iowbc.task.specification import Specification

FREQUENCY, AMPLITUDE = 4.0, 5.0
PULL = PlannedPull(0.2, 0.5, FREQUENCY, (0.0, AMPLITUDE))
CALM = {**UNDISTURBED, "noise_scale": 0.0}


class Action:
    """The same action in every step."""

    def __init__(self, value: float) -> None:
        self.value = value

    def reset(self, which: NDArray[np.bool_]) -> None:
        """Nothing to forget."""

    def act(self, observation: NDArray[np.float32], privileged: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.full((len(observation), 15), self.value, np.float32)


@pytest.fixture(scope="module")
def recipe() -> Recipe:
    return Recipe.model_validate({"name": "test", "task": {"references": {"use_rg": False}}})


@pytest.fixture(scope="module")
def played(recipe: Recipe) -> dict[str, tuple[Trial, Outcome]]:
    """Short trials of a robot that keeps an action: pulled at, with a partner that leads, behind a crate."""
    script = command_script([Segment(duration=0.8, ramp=0.0, velocity=(0.3, 0.0, 0.0))], recipe.task.commands)
    leader = {"partner_share": 0.5, "partner_behaviour": float(BEHAVIOURS.index("leader"))}
    conditions = {
        "impedance": ("lift", {"partner_share": 0.0}, PULL),
        "compliance": ("lift", leader, None),
        "map": ("push", {"partner_share": 0.0}, None),
    }
    trials = [
        Trial(kind, kind, kind, 4.0, 0, planned_episode(scene, script, 4.0, 7, CALM | fixed, pull=pull))
        for kind, (scene, fixed, pull) in conditions.items()
    ]
    world = Specification(recipe, robot_folder("g1"), None)
    outcomes = play_episodes(world, [trial.episode for trial in trials], Action(0.2), workers=0)
    return {trial.kind: (trial, outcome) for trial, outcome in zip(trials, outcomes, strict=True)}


def test_a_pull_is_recorded_as_the_force_on_the_object(played: dict[str, tuple[Trial, Outcome]]) -> None:
    _, outcome = played["impedance"]
    trace = outcome.trace
    time = trace.dt * (np.arange(len(trace)) + 0.5) - PULL.begin
    size = AMPLITUDE * np.sin(2 * np.pi * FREQUENCY * time) * ((time > 0) & (time < PULL.duration))
    yaw = trace.heading_reference[0]
    left = np.array([-np.sin(yaw), np.cos(yaw)])
    assert trace.external_force[:, :2] @ left == pytest.approx(size, abs=1e-6)
    assert trace.external_force[:, :2] @ [left[1], -left[0]] == pytest.approx(0.0, abs=1e-6)


def test_the_row_of_a_pull_has_an_impedance_and_no_partner(
    recipe: Recipe, played: dict[str, tuple[Trial, Outcome]]
) -> None:
    row = trial_row(recipe, load_robot(robot_folder("g1")), *played["impedance"])
    assert (row["pull_frequency"], row["pull_direction"]) == (FREQUENCY, "left")
    assert row["impedance_magnitude"] > 2 * np.pi * FREQUENCY * 2.0, "the object alone has 4 kg"
    assert np.isnan([row["E_v_partner"], row["handle_force_p95"], row["partner_work"]]).all()


def test_the_row_of_a_partner_has_its_force_its_work_and_its_motion(
    recipe: Recipe, played: dict[str, tuple[Trial, Outcome]]
) -> None:
    trial, outcome = played["compliance"]
    trace = outcome.trace
    row = trial_row(recipe, load_robot(robot_folder("g1")), trial, outcome)
    assert row["handle_force_peak"] == pytest.approx(np.hypot(*trace.partner_force[:, :2].T).max())
    assert np.isfinite(row["partner_work"])
    assert np.any(trace.partner_velocity)
    assert np.any(trace.handle_displacement)
    assert np.isnan(row["impedance_magnitude"])
    assert row["pull_direction"] == ""


def test_the_action_is_recorded_in_radians_and_has_no_second_difference_where_it_rests(
    recipe: Recipe, played: dict[str, tuple[Trial, Outcome]]
) -> None:
    robot = load_robot(robot_folder("g1"))
    trial, outcome = played["map"]
    assert outcome.trace.action == pytest.approx(np.tile(0.2 * robot.action_scale, (len(outcome.trace), 1)))
    row = trial_row(recipe, robot, trial, outcome)
    assert row["action_second_difference"] == pytest.approx(0.0, abs=1e-9)
    assert row["foot_force_peak"] >= outcome.trace.foot_load.max()
    assert 0.0 <= row["pressure_margin"] < 0.03
    assert 0.0 < row["torque_rms"] <= 1.0
