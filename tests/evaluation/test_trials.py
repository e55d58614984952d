"""Which trials a recipe asks for."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from pydantic import ValidationError

from iowbc.evaluation.films import filmed
from iowbc.evaluation.trials.plan import (
    SPLITS,
    PlannedSweep,
    case_trials,
    command_script,
    compliance_trials,
    map_trials,
    planned_sweeps,
    push_trials,
    sequence_for,
)
from iowbc.evaluation.trials.protocol import batched_by_duration, evaluated_world
from iowbc.recipe.evaluation.sequences import LIFTING, PUSHING, Segment
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.simulation.partner import BEHAVIOURS
from iowbc.recipe.task.commands import Commands
from iowbc.robot.description import robot_folder
from iowbc.task.specification import Specification

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
    seeds = [SPLITS["test"] + number for number in (50, 51, 52)]
    assert [trial.episode.seed for trial in light] == seeds == [trial.episode.seed for trial in heavy]
    assert len({trial.episode.script for trial in trials}) == 1
    assert {trial.episode.fixed["object_mass"] for trial in heavy} == {5.0}
    assert {trial.episode.duration for trial in trials} == {5.0}


@pytest.mark.parametrize("lightest", [0.0, 0.05])
def test_the_lightest_row_of_a_sweep_has_an_object(lightest: float) -> None:
    for one in planned_sweeps(asked(lifting={"masses": [lightest, 4]})):
        trials = [trial for trial in one.named() if trial.case == one.suite]
        first = trials[0]
        assert (first.mass, first.episode.scene, first.episode.fixed["object_mass"]) == (0.05, "lift", 0.05)
        assert "free" not in {trial.episode.scene for trial in trials}


def test_the_walk_without_an_object_is_a_row_of_its_own_played_once_and_alone() -> None:
    trials = [trial for one in planned_sweeps(asked(trials=2, lifting={"masses": [4]})) for trial in one.named()]
    bare = [trial for trial in trials if trial.episode.scene == "free"]
    assert [(t.suite, t.case, t.mass, t.number) for t in bare] == [("lifting", "no object", 0.0, k) for k in range(2)]
    assert all("object_mass" not in trial.episode.fixed for trial in bare)
    (without,) = planned_sweeps(asked(lifting={"masses": [4], "partner_shares": [0], "no_object": False}))
    assert {trial.case for trial in without.named()} == {"lifting"}


def test_sweeps_are_made_with_and_without_the_partner() -> None:
    planned = planned_sweeps(asked(lifting={"masses": [4]}))
    assert [one.suite for one in planned] == ["lifting", "lifting with partner 0.5"]
    shares = [{trial.episode.fixed["partner_share"] for trial in one.trials((4.0,))} for one in planned]
    assert shares == [{0.0}, {0.5}]


def test_masses_and_rolling_resistance_may_depend_on_the_partners_share() -> None:
    shared = {"partner_share": 0.5, "masses": [60, 90], "rolling_resistance": 0.1}
    pushing = {"scene": "push", "masses": [10], "rolling_resistance": 0.06, "with_share": [shared], "no_object": False}
    alone, helped = planned_sweeps(asked(pushing=pushing))
    assert (alone.masses, helped.masses) == ((10.0,), (60.0, 90.0))
    resistances = [{t.episode.fixed["object_ground_friction"] for t in one.named()} for one in (alone, helped)]
    assert resistances == [{0.06}, {0.1}]
    with pytest.raises(ValidationError, match="with_share must name each of partner_shares once"):
        asked(pushing=pushing | {"with_share": [shared | {"partner_share": 0.3}]})


def test_a_second_suite_is_without_disturbances_and_in_the_same_worlds() -> None:
    planned = planned_sweeps(
        asked(disturbances=True, lifting={"masses": [1, 4], "undisturbed": [4], "no_object": False})
    )
    assert [one.suite for one in planned] == [
        "lifting",
        "lifting with partner 0.5",
        "lifting undisturbed",
        "lifting with partner 0.5 undisturbed",
    ]
    disturbed, calm = planned[0].trials((4.0,)), planned[2].named()
    assert [trial.episode.seed for trial in disturbed] == [trial.episode.seed for trial in calm]
    assert all(trial.episode.fixed["push_scale"] == 0.0 for trial in calm)
    assert all("push_scale" not in trial.episode.fixed for trial in disturbed), "at its nominal strength, one"
    assert len(planned_sweeps(asked(lifting={"undisturbed": [4]}))) == 2, "beside undisturbed ones there is no other"


def test_the_compliance_suite_has_every_behaviour_a_blocked_crate_and_pulls() -> None:
    trials = list(compliance_trials(asked(trials=2, disturbances=True, compliance={"partner_shares": [0.5]})))
    assert {"impulse_scale": 0.0, "push_scale": 0.0}.items() <= trials[0].episode.fixed.items(), "never disturbed"
    held = {t.case: t.episode.fixed["partner_behaviour"] for t in trials if "partner_behaviour" in t.episode.fixed}
    assert held == {name: float(place) for place, name in enumerate(BEHAVIOURS)}
    (crate,) = {trial.episode.scene for trial in trials if trial.case == "blocked crate"}
    assert crate == "push"
    pulled = {trial.case: trial.episode for trial in trials if trial.kind == "impedance"}
    assert len(pulled) == 8
    for case, episode in pulled.items():
        pull = episode.pull
        assert pull is not None
        axis, frequency, _ = case.split(" ")
        assert pull.frequency == float(frequency)
        assert pull.force == ((10.0, 0.0) if axis == "x" else (0.0, 10.0))
        periods = pull.duration * pull.frequency
        assert periods == pytest.approx(round(periods)), "whole periods"
        assert pull.begin + pull.duration < episode.duration
    several = compliance_trials(asked(compliance={"partner_shares": [0.3, 0.5], "behaviours": ["leader"]}))
    assert {t.suite for t in several if t.case == "leader"} == {
        "compliance with partner 0.3",
        "compliance with partner 0.5",
    }


def test_the_map_is_a_grid_of_rolling_resistance_and_mass() -> None:
    trials = map_trials(asked(map={"rolling_resistances": [0.02, 0.15], "masses": [10, 80], "trials": 1}))
    cells = {(t.case, t.mass, t.episode.fixed["object_ground_friction"]) for t in trials}
    assert cells == {("μ 0.02", 10, 0.02), ("μ 0.02", 80, 0.02), ("μ 0.15", 10, 0.15), ("μ 0.15", 80, 0.15)}


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
    trials = list(case_trials(asked(heavy=heavy, trials=2, stagnation={})))
    assert [(t.kind, t.case, t.mass, t.number) for t in trials] == [
        ("heavy", "tyre", 18.0, 0),
        ("heavy", "tyre", 18.0, 1),
        ("heavy", "crate", 65.0, 0),
        ("heavy", "crate", 65.0, 1),
        ("stagnation", "blocked crate", 65.0, 0),
        ("stagnation", "blocked crate", 65.0, 1),
    ]
    assert [t.episode.fixed["partner_share"] for t in trials[::2]] == [0.5, 0.5, 0.0]
    assert trials[4].episode.fixed["resistance_scale"] == 50.0


def test_the_robustness_suite_has_a_minute_and_a_box_held_by_friction() -> None:
    question = Recipe.model_validate({"name": "test", "eval": {"lifting": None, "robustness": {}}})
    recipe = evaluated_world(Specification(question, robot_folder("g1"))).recipe
    assert {trial.case for trial in case_trials(recipe) if trial.episode.scene == "squeeze"} == {"held by friction"}
    durations = {trial.case: trial.episode.duration for trial in case_trials(recipe)}
    assert durations["60 s"] == 60.0
    assert set(durations.values()) == {15.0, 20.0, 60.0}
    assert {"latency 30 + 30 ms", "box 0.2 m wide", "box 0.45 m wide", "weak motors and linkages"} <= set(durations)


def test_pushes_grow_in_every_direction_with_the_same_seeds() -> None:
    asked_for = {
        "pushes": {"impulses": [10, 30], "directions": ["left"], "trials": None},
        "walking_pushes": {"impulses": [20], "directions": ["backward right"], "trials": 1},
    }
    trials = list(push_trials(asked(trials=2, robustness=asked_for)))
    walking = trials.pop()
    assert (walking.case, walking.impulse) == ("backward right, walking", 20.0)
    assert walking.episode.push is not None
    assert walking.episode.push.impulse == pytest.approx((-20 / 2**0.5, -20 / 2**0.5))
    assert [(t.case, t.impulse, t.number) for t in trials] == [
        ("left", 10.0, 0),
        ("left", 10.0, 1),
        ("left", 30.0, 0),
        ("left", 30.0, 1),
    ]
    assert trials[2].episode.push is not None
    assert trials[2].episode.push.impulse == pytest.approx((0.0, 30.0))
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
    recipe = Recipe.model_validate(
        {
            "name": "test",
            "eval": {"trials": 3, "robustness": {"cases": [{"name": "a"}, {"name": "60 s", "repetitions": 3}]}},
        }
    )
    trials = [trial for one in planned_sweeps(recipe) for trial in one.trials((0.05, 4.0))]
    trials += case_trials(recipe)
    batches = list(batched_by_duration(trials, 8))
    assert [len(batch) for batch in batches] == [8, 7, 3]
    assert all(len({trial.episode.duration for trial in batch}) == 1 for batch in batches)
    assert sum(map(len, batches)) == len(trials)


def test_films_are_spread_over_the_masses_that_are_held() -> None:
    kinds = [("lifting", float(mass), trial) for mass in range(9) for trial in range(5)] + [("pushes", 4.0, 0)]
    cases = {"lifting": "lifting", "pushes": "forward"}
    rows = [
        {"suite": kind, "case": cases[kind], "kind": kind, "mass": mass, "trial": trial} for kind, mass, trial in kinds
    ]
    names = {count: [name for name, _ in filmed(pd.DataFrame(rows), count)] for count in (0, 1, 2, 3, 99)}
    assert names[0] == []
    assert names[1] == ["lifting_4kg"]
    assert names[2] == ["lifting_1kg", "lifting_8kg"]
    assert names[3] == ["lifting_1kg", "lifting_5kg", "lifting_8kg"]
    assert len(names[99]) == len(np.unique(names[99])) == 8
    blocked = [
        {"suite": suite, "case": "blocked crate", "kind": suite, "mass": 65.0, "trial": 0}
        for suite in ("stagnation", "compliance")
    ]
    found = [name for name, _ in filmed(pd.DataFrame(rows + blocked), 99)]
    assert found[-2:] == ["stagnation_blocked_crate_65kg", "compliance_blocked_crate_65kg"]
