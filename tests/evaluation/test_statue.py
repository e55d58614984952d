"""A robot that does not move fails every trial of every suite of full.yaml."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_up_trials import DT, outcome, trace

from iowbc.evaluation.trials.metrics import succeeded, trial_metrics
from iowbc.evaluation.trials.plan import (
    Trial,
    case_trials,
    compliance_trials,
    map_trials,
    planned_sweeps,
    push_trials,
)
from iowbc.evaluation.trials.protocol import evaluated_world
from iowbc.evaluation.trials.rollout import Outcome
from iowbc.recipe.reading.loading import load_recipe
from iowbc.robot.description import GRAVITY, load_robot, robot_folder
from iowbc.task.specification import Specification

FULL = Path(__file__).parents[2] / "recipes" / "full.yaml"
RECIPE = evaluated_world(Specification(load_recipe(FULL).recipe, robot_folder("g1"))).recipe
ROBOT = load_robot(robot_folder("g1"))
SUITES = {
    "sweeps": [trial for sweep in planned_sweeps(RECIPE) for trial in sweep.named()],
    "cases": list(case_trials(RECIPE)),
    "pushes": list(push_trials(RECIPE)),
    "compliance": list(compliance_trials(RECIPE)),
    "map": list(map_trials(RECIPE)),
}


def statue(trial: Trial) -> Outcome:
    """What is recorded of a robot that stands in the nominal posture for the whole trial, with the object's weight in
    its hands, where it trembles by a tenth of a millimetre, or its palms at a crate that they do not push."""
    steps = round(trial.episode.duration / DT)
    commands, kind = RECIPE.task.commands, getattr(RECIPE.simulation.scenes, trial.episode.scene).kind
    carried = GRAVITY * trial.mass if kind == "lift" else 0.0
    grips = np.zeros((steps, 6))
    grips[:, [2, 5]] = -carried / 2
    ahead = np.tile([0.3, 0.0, 1.0] if kind != "free" else np.zeros(3), (steps, 1))
    ahead += 1e-4 * ahead.any() * np.sin(DT * np.arange(steps))[:, None]
    recorded = replace(
        trace(steps),
        pelvis_height=np.full(steps, commands.nominal_height),
        torso_pitch=np.full(steps, commands.nominal_pitch),
        object_position=ahead,
        grip_force=grips,
        joint_torque=np.zeros((steps, len(ROBOT.joints))),
        joint_saturation=np.zeros((steps, len(ROBOT.joints))),
    )
    return outcome(recorded, trial.mass, friction=0.5, rolling=38.0, robot=ROBOT)


@pytest.mark.parametrize("suite", SUITES)
def test_a_statue_fails_every_suite(suite: str) -> None:
    cells = {(trial.suite, trial.case, trial.mass, trial.impulse): trial for trial in SUITES[suite]}
    assert cells
    passed = []
    for trial in cells.values():
        metrics = trial_metrics(RECIPE, ROBOT, trial.episode, statue(trial)) | {"seconds": trial.episode.duration}
        if succeeded(RECIPE.eval.success, trial.kind, metrics, blocked=trial.case == "blocked crate"):
            passed.append((trial.suite, trial.case, trial.mass))
    assert not passed


def test_what_a_statue_lacks_is_motion_and_push_alone() -> None:
    (trial, *_) = SUITES["sweeps"]
    metrics = trial_metrics(RECIPE, ROBOT, trial.episode, statue(trial)) | {"seconds": trial.episode.duration}
    moved = metrics | {"transport_robot": 1.0, "transport_object": 1.0}
    assert succeeded(RECIPE.eval.success, trial.kind, moved)
    stagnating = {"E_alpha": 0.1, "E_h": 0.01, "push_force_share": 0.6, "foot_slip": 0.5, "seconds": 10.0}
    assert succeeded(RECIPE.eval.success, "stagnation", stagnating)
    for name, value in (("push_force_share", 0.4), ("foot_slip", 2.0), ("E_h", 0.1), ("E_alpha", 0.5)):
        assert not succeeded(RECIPE.eval.success, "stagnation", stagnating | {name: value}), name


def test_compliance_fails_above_its_bounds_of_force() -> None:
    success = RECIPE.eval.success
    along = {"transport_robot": 0.3, "transport_object": 0.3, "weight_in_hands": 1.0, "object_beside": 0.1}
    along |= {"E_alpha": 0.1, "E_h": 0.01, "handle_force_p95": success.handle_force, "push_force": 30.0}
    assert succeeded(success, "compliance", along)
    assert not succeeded(success, "compliance", along | {"handle_force_p95": success.handle_force + 1.0})
    assert not succeeded(success, "lifting", along), "alone more of the way is asked for"
    blocked = along | {"hand_force_p95": success.hand_force}
    assert succeeded(success, "compliance", blocked, blocked=True)
    assert not succeeded(success, "compliance", blocked | {"hand_force_p95": success.hand_force + 1.0}, blocked=True)
    assert not succeeded(success, "compliance", blocked | {"push_force": 5.0}, blocked=True)
