"""Which trials a recipe asks for."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from iowbc.evaluation.films import filmed
from iowbc.evaluation.trials.plan import (
    PlannedSweep,
    case_trials,
    command_script,
    planned_sweeps,
    push_trials,
    sequence_for,
)
from iowbc.evaluation.trials.protocol import batched_by_duration
from iowbc.recipe.evaluation.segment import Segment
from iowbc.recipe.evaluation.sequences import LIFTING, PUSHING
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.commands import Commands

COMMANDS = Commands()
SEQUENCE = [{"duration": 2.0}, {"duration": 3.0, "velocity": [0.4, 0, 0]}]


def asked(**fields: Any) -> Recipe:
    return Recipe.model_validate({"name": "test", "eval": {"sequence": SEQUENCE, "lifting": None, **fields}})


def sweep(recipe: Recipe) -> PlannedSweep:
    (planned,) = planned_sweeps(recipe)
    return planned


def test_every_mass_meets_the_same_seeds_and_commands() -> None:
    trials = sweep(asked(trials=3, seed=50, lifting={"partner_shares": [0]})).trials((1.0, 5.0))
    light, heavy = trials[:3], trials[3:]
    assert [trial.episode.seed for trial in light] == [50, 51, 52] == [trial.episode.seed for trial in heavy]
    assert len({trial.episode.script for trial in trials}) == 1
    assert {trial.episode.fixed["object_mass"] for trial in heavy} == {5.0}
    assert {trial.episode.duration for trial in trials} == {5.0}


def test_no_mass_is_played_without_an_object() -> None:
    planned = sweep(asked(pushing={"scene": "push", "partner_shares": [0]}))
    trials = planned.trials((0.0, 10.0))
    assert {(trial.mass, trial.episode.scene) for trial in trials} == {(0.0, "free"), (10.0, "push")}
    assert all("object_mass" not in trial.episode.fixed for trial in trials if trial.mass == 0)


def test_sweeps_are_made_with_and_without_the_partner() -> None:
    planned = planned_sweeps(asked(lifting={"masses": [4]}))
    assert [one.suite for one in planned] == ["lifting", "lifting with partner 0.5"]
    shares = [{trial.episode.fixed["partner_share"] for trial in one.trials((4.0,))} for one in planned]
    assert shares == [{0.0}, {0.5}]


def test_disturbances_are_off_unless_asked_for() -> None:
    for disturbances in (False, True):
        recipe = asked(disturbances=disturbances, lifting={"partner_shares": [0]})
        fixed = sweep(recipe).trials((1.0,))[0].episode.fixed
        assert ("impulse_scale" in fixed) is not disturbances
        assert ("push_scale" in fixed) is not disturbances


def test_what_a_sweep_holds_fixed_reaches_the_episode() -> None:
    held = {"scene": "push", "rolling_resistance": 0.05, "partner_shares": [None], "fixed": {"noise_scale": 0.0}}
    planned = sweep(asked(pushing=held))
    fixed = planned.trials((30.0,))[0].episode.fixed
    assert planned.suite == "pushing with drawn partner"
    assert fixed["object_ground_friction"] == 0.05
    assert fixed["noise_scale"] == 0.0
    assert "partner_share" not in fixed


def test_cases_keep_their_names_masses_and_conditions() -> None:
    heavy = [{"name": "tyre", "scene": "tyre", "mass": 18.0}, {"name": "crate", "scene": "push", "mass": 65.0}]
    trials = case_trials(asked(heavy=heavy, trials=2, stagnation={}))
    assert [(t.kind, t.case, t.mass, t.number) for t in trials] == [
        ("heavy", "tyre", 18.0, 0),
        ("heavy", "tyre", 18.0, 1),
        ("heavy", "crate", 65.0, 0),
        ("heavy", "crate", 65.0, 1),
        ("stagnation", "crate above friction", 65.0, 0),
        ("stagnation", "crate above friction", 65.0, 1),
        ("stagnation", "blocked crate", 65.0, 0),
        ("stagnation", "blocked crate", 65.0, 1),
    ]
    assert [t.episode.fixed["partner_share"] for t in trials[::2]] == [0.5, 0.5, 0.0, 0.0]
    assert trials[4].episode.fixed["object_ground_friction"] == 1.0
    assert trials[6].episode.fixed["resistance_scale"] == 50.0


def test_the_robustness_suite_has_a_minute_and_a_box_held_by_friction() -> None:
    recipe = Recipe.model_validate({"name": "test", "eval": {"lifting": None, "robustness": {}}})
    assert {trial.case for trial in case_trials(recipe) if trial.episode.scene == "squeeze"} == {"held by friction"}
    durations = {trial.case: trial.episode.duration for trial in case_trials(recipe)}
    assert durations["60 s"] == 60.0
    assert set(durations.values()) == {20.0, 60.0}


def test_pushes_grow_in_every_direction_with_the_same_seeds() -> None:
    trials = push_trials(asked(trials=2, robustness={"pushes": {"impulses": [10, 30], "directions": ["left"]}}))
    assert [(t.case, t.impulse, t.number) for t in trials] == [
        ("left", 10.0, 0),
        ("left", 10.0, 1),
        ("left", 30.0, 0),
        ("left", 30.0, 1),
    ]
    assert trials[2].episode.push is not None
    assert trials[2].episode.push.impulse == (0.0, 30.0)
    assert trials[0].episode.seed == trials[2].episode.seed


def test_a_sequence_becomes_the_command_over_time() -> None:
    sequence = (Segment(duration=2.0, ramp=0.0), Segment(duration=4.0, ramp=1.0, velocity=(0.4, 0, 0), height=0.6))
    script = command_script(sequence, COMMANDS)
    start, halfway, end = script.at(0.0), script.at(2.5), script.at(6.0)
    assert start[3] == COMMANDS.nominal_height
    assert halfway[0] == pytest.approx(0.2)
    assert halfway[3] == pytest.approx((COMMANDS.nominal_height + 0.6) / 2)
    assert (end[0], end[3]) == pytest.approx((0.4, 0.6))


def test_lifting_and_pushing_have_their_own_commands_unless_the_recipe_gives_some() -> None:
    recipe = Recipe(name="test")
    assert sequence_for(recipe, "lift") == sequence_for(recipe, "tyre") == LIFTING
    assert sequence_for(recipe, "push") == PUSHING
    own = (Segment(duration=1.0),)
    assert sequence_for(recipe, "push", own) == own
    assert [segment.duration for segment in sequence_for(asked(lifting={}), "push")] == [2.0, 3.0]


def test_a_sweep_goes_on_in_steps_up_to_its_limit() -> None:
    shares = {"partner_shares": [0]}
    planned = sweep(asked(lifting={"masses": [8], "beyond": {"step": 2, "limit": 12}, **shares}))
    assert [planned.heavier(mass) for mass in (8.0, 10.0, 12.0)] == [10.0, 12.0, None]
    assert sweep(asked(lifting={"masses": [8], **shares})).heavier(8.0) is None


def test_trials_are_batched_with_those_that_last_as_long() -> None:
    recipe = Recipe.model_validate({"name": "test", "eval": {"trials": 3, "robustness": {"pushes": None}}})
    trials = [trial for one in planned_sweeps(recipe) for trial in one.trials((0.0, 4.0))] + case_trials(recipe)
    batches = list(batched_by_duration(trials, 16))
    assert [len(batch) for batch in batches] == [12, 12, 12, 3]
    assert all(len({trial.episode.duration for trial in batch}) == 1 for batch in batches)
    assert sum(map(len, batches)) == len(trials)


def test_films_are_spread_over_the_masses_that_are_held() -> None:
    rows = [
        {"case": "lifting", "kind": "lifting", "mass": float(mass), "trial": k} for mass in range(9) for k in range(5)
    ]
    rows.append({"case": "forward", "kind": "pushes", "mass": 4.0, "trial": 0})
    names = {count: [name for name, _ in filmed(pd.DataFrame(rows), count)] for count in (0, 1, 2, 3, 99)}
    assert names[0] == []
    assert names[1] == ["lifting_4kg"]
    assert names[2] == ["lifting_1kg", "lifting_8kg"]
    assert names[3] == ["lifting_1kg", "lifting_5kg", "lifting_8kg"]
    assert len(names[99]) == len(np.unique(names[99])) == 8
