"""Which trials a recipe asks for."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from iowbc.evaluation.films import filmed
from iowbc.evaluation.trials.plan import command_script, heavier_mass, heavy_trials, sweep_trials
from iowbc.recipe.evaluation import Beyond, Evaluation, HeavyCase, Segment, Sweep
from iowbc.recipe.task.commands import Commands

COMMANDS = Commands()


def evaluation(**fields: Any) -> Evaluation:
    return Evaluation(sequence=(Segment(duration=2.0), Segment(duration=3.0, velocity=(0.4, 0, 0))), **fields)


def test_every_mass_meets_the_same_seeds_and_commands() -> None:
    asked = evaluation(trials=3, seed=50)
    assert asked.lifting is not None
    trials = sweep_trials(asked, COMMANDS, "lifting", asked.lifting, (1.0, 5.0))
    light, heavy = trials[:3], trials[3:]
    assert [trial.episode.seed for trial in light] == [50, 51, 52] == [trial.episode.seed for trial in heavy]
    assert len({trial.episode.script for trial in trials}) == 1
    assert {trial.episode.fixed["object_mass"] for trial in heavy} == {5.0}
    assert {trial.episode.duration for trial in trials} == {5.0}


def test_no_mass_is_played_without_an_object() -> None:
    asked = evaluation(pushing=Sweep(scene="push", masses=(0.0, 10.0)))
    assert asked.pushing is not None
    trials = sweep_trials(asked, COMMANDS, "pushing", asked.pushing, asked.pushing.masses)
    assert {(trial.mass, trial.episode.scene) for trial in trials} == {(0.0, "free"), (10.0, "push")}
    assert all("object_mass" not in trial.episode.fixed for trial in trials if trial.mass == 0)


def test_disturbances_are_off_unless_asked_for() -> None:
    for disturbances in (False, True):
        asked = evaluation(disturbances=disturbances)
        assert asked.lifting is not None
        fixed = sweep_trials(asked, COMMANDS, "lifting", asked.lifting, (1.0,))[0].episode.fixed
        assert ("impulse_scale" in fixed) is not disturbances
        assert ("push_scale" in fixed) is not disturbances


def test_what_a_sweep_holds_fixed_reaches_the_episode() -> None:
    sweep = Sweep(scene="push", masses=(30.0,), rolling_resistance=0.05, partner_share=None, fixed={"noise_scale": 0.0})
    asked = evaluation(pushing=sweep)
    fixed = sweep_trials(asked, COMMANDS, "pushing", sweep, (30.0,))[0].episode.fixed
    assert fixed["object_ground_friction"] == 0.05
    assert fixed["noise_scale"] == 0.0
    assert "partner_share" not in fixed


def test_heavy_cases_keep_their_names_and_masses() -> None:
    cases = (HeavyCase(name="tyre", scene="tyre", mass=18.0), HeavyCase(name="crate", scene="push", mass=65.0))
    trials = heavy_trials(evaluation(heavy=cases, trials=2), COMMANDS)
    assert [(t.case, t.mass, t.number) for t in trials] == [
        ("tyre", 18.0, 0),
        ("tyre", 18.0, 1),
        ("crate", 65.0, 0),
        ("crate", 65.0, 1),
    ]
    assert {trial.suite for trial in trials} == {"heavy"}


def test_a_sequence_becomes_the_command_over_time() -> None:
    sequence = (Segment(duration=2.0, ramp=0.0), Segment(duration=4.0, ramp=1.0, velocity=(0.4, 0, 0), height=0.6))
    script = command_script(sequence, COMMANDS)
    start, halfway, end = script.at(0.0), script.at(2.5), script.at(6.0)
    assert start[3] == COMMANDS.nominal_height
    assert halfway[0] == pytest.approx(0.2)
    assert halfway[3] == pytest.approx((COMMANDS.nominal_height + 0.6) / 2)
    assert (end[0], end[3]) == pytest.approx((0.4, 0.6))


def test_a_sweep_goes_on_in_steps_up_to_its_limit() -> None:
    sweep = Sweep(masses=(8.0,), beyond=Beyond(step=2.0, limit=12.0))
    assert heavier_mass(sweep, 8.0) == 10.0
    assert heavier_mass(sweep, 10.0) == 12.0
    assert heavier_mass(sweep, 12.0) is None
    assert heavier_mass(Sweep(masses=(8.0,)), 8.0) is None


def test_films_are_spread_over_the_masses_that_are_held() -> None:
    rows = [{"case": "lifting", "mass": float(mass), "trial": k} for mass in range(9) for k in range(5)]
    names = {count: [name for name, _ in filmed(pd.DataFrame(rows), count)] for count in (0, 1, 2, 3, 99)}
    assert names[0] == []
    assert names[1] == ["lifting_4kg"]
    assert names[2] == ["lifting_1kg", "lifting_8kg"]
    assert names[3] == ["lifting_1kg", "lifting_5kg", "lifting_8kg"]
    assert len(names[99]) == len(np.unique(names[99])) == 8
