"""Drawn command scripts: every kind of motion, within what commands may do, the same for all that is compared."""

import numpy as np
import pytest

from iowbc.arrays import Array
from iowbc.control.command import rate_limits
from iowbc.evaluation.trials.errors import ERRORS, commanded_path, deviations_standing_still
from iowbc.evaluation.trials.plan import SPLITS, planned_sweeps, trial_seed
from iowbc.evaluation.trials.quick import quick_trials
from iowbc.evaluation.trials.scripts import drawn_script
from iowbc.recipe.evaluation.evaluation import Evaluation
from iowbc.recipe.evaluation.sequences import DrawnScripts
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.task.commands import Commands
from iowbc.recipe.teacher import Check
from iowbc.robot.description import robot_folder
from iowbc.task.episodes import CommandScript
from iowbc.task.specification import Specification

SCRIPTS, COMMANDS, DT = DrawnScripts(), Commands(), 0.02
LOWEST, BOW = 0.6, 0.4


def drawn(seed: int, *, pushing: bool = False, scripts: DrawnScripts = SCRIPTS) -> CommandScript:
    return drawn_script(scripts, COMMANDS, pushing=pushing, seed=seed)


def given(script: CommandScript) -> Array:
    return script.at(DT * np.arange(round(script.duration / DT)))


@pytest.mark.parametrize("pushing", [False, True])
def test_scripts_keep_to_the_ranges_and_rates_of_commands(pushing: bool) -> None:
    own = COMMANDS.pushing if pushing else COMMANDS
    for seed in range(100):
        script = drawn(seed, pushing=pushing)
        commands = given(script)
        assert script.duration == pytest.approx(SCRIPTS.duration)
        steepest = np.abs(np.diff(commands, axis=0)).max(axis=0) / DT
        assert (steepest <= rate_limits(COMMANDS.rates) * (1 + 1e-6)).all()
        for column, (low, high) in enumerate((own.velocity_x, own.velocity_y, own.yaw_rate, COMMANDS.height)):
            assert low - 1e-9 <= commands[:, column].min() <= commands[:, column].max() <= high + 1e-9
        assert COMMANDS.pitch[0] <= commands[:, 4].min() <= commands[:, 4].max() <= COMMANDS.deep_pitch[1]


def test_every_script_of_a_lift_has_every_kind_of_motion() -> None:
    for seed in range(50):
        ends = np.array([segment.command for segment in drawn(seed).segments])
        stands = ~ends[:, :3].any(axis=1)
        assert (ends[:, 0] > 0).sum() >= 2, "walks"
        assert (ends[:, 0] < 0).any(), "back"
        assert ends[:, 1].any(), "sideways"
        assert ends[:, 2].min() < 0 < ends[:, 2].max(), "both turns"
        assert (ends[:, 7] > 0).any(), "raised hands"
        assert (stands & (ends[:, 3] <= LOWEST)).any(), "crouch"
        assert (stands & (ends[:, 4] >= BOW)).any(), "bow"
        assert not ends[0, :3].any(), "stands at first"


def test_a_push_goes_neither_back_nor_sideways_and_turns_slowly() -> None:
    for seed in range(50):
        commands = given(drawn(seed, pushing=True))
        assert commands[:, 0].min() >= 0.0
        assert not commands[:, 1].any()
        assert -0.1 <= commands[:, 2].min() < -0.04
        assert 0.04 < commands[:, 2].max() <= 0.1


def test_deep_bows_go_as_far_as_the_tasks_commands_do() -> None:
    always = DrawnScripts(deep_share=1.0)
    deepest = [max(segment.command[4] for segment in drawn(seed, scripts=always).segments) for seed in range(50)]
    assert COMMANDS.pitch[1] <= min(deepest)
    assert 1.3 < max(deepest) <= COMMANDS.deep_pitch[1]
    shallow = Commands(deep_pitch=(-0.5, 1.0))
    bows = [drawn_script(always, shallow, pushing=False, seed=seed) for seed in range(50)]
    assert max(segment.command[4] for bow in bows for segment in bow.segments) <= 1.0
    some = [max(segment.command[4] for segment in drawn(seed).segments) > COMMANDS.pitch[1] for seed in range(200)]
    assert np.mean(some) == pytest.approx(SCRIPTS.deep_share, abs=0.06)


def test_no_two_seeds_have_the_same_script_and_one_seed_always_has() -> None:
    scripts = [drawn(seed) for seed in range(20)]
    assert len(set(scripts)) == 20
    assert scripts == [drawn(seed) for seed in range(20)]
    parts = [drawn_script(SCRIPTS, COMMANDS, pushing=False, seed=0, part=part) for part in range(3)]
    assert len(set(parts)) == 3, "a trial of three scripts hears none twice"


@pytest.mark.parametrize("pushing", [False, True])
def test_a_statue_covers_nothing_of_a_drawn_script_and_misses_every_error_of_the_papers(pushing: bool) -> None:
    for seed in range(50):
        commands = given(drawn(seed, pushing=pushing))
        _, length = commanded_path(commands, 0.0, DT)
        assert length > 2.0
    many = np.concatenate([given(drawn(seed, pushing=pushing)) for seed in range(20)])
    still = deviations_standing_still(many, COMMANDS, DT).means()
    assert all(still[name] > error for name, error in zip(ERRORS[1:3], (0.015, 0.046), strict=True))


def recipe(**asked: object) -> Recipe:
    return Recipe.model_validate({"name": "test", "eval": {"scripts": {}, "lifting": {}, **asked}})


def test_a_trials_script_is_the_same_at_every_mass_in_every_suite_and_variant() -> None:
    scripts = {}
    for variant in (recipe(), recipe(label="WBC", simulation={}, policy="teacher")):
        for sweep in planned_sweeps(variant):
            for trial in sweep.named():
                scripts.setdefault(trial.number, set()).add(trial.episode.script)
    assert {number: len(own) for number, own in scripts.items()} == dict.fromkeys(range(5), 1)
    assert len(set().union(*scripts.values())) == 5, "and another for each number"


def test_a_sequence_goes_before_drawn_scripts() -> None:
    (trial, *_) = planned_sweeps(recipe(sequence=[{"duration": 3.0}]))[0].named()
    assert trial.episode.duration == 3.0


def test_development_and_test_never_share_a_seed() -> None:
    largest = 2**32 - 1
    field = Evaluation.model_fields["seed"]
    assert any(getattr(limit, "lt", None) == 2**32 for limit in field.metadata)
    most = 10_000
    last_development = trial_seed(Evaluation(split="development", seed=largest), most)
    assert last_development < trial_seed(Evaluation(split="test", seed=0), 0)
    assert largest + 1000 < SPLITS["test"], "nor does a check of a thousand trials"


def test_a_check_plays_scripts_of_the_development_split() -> None:
    own = recipe().model_copy(update={"eval": Evaluation(sequence=(), scripts=SCRIPTS)})
    world = Specification(own, robot_folder("g1"))
    check = Check(sequence=(), scripts=SCRIPTS)
    development = quick_trials(world, "lift", (4.0, 8.0), check.trials, check.seed)
    seeds = {trial.episode.seed for trial in development}
    assert seeds == {check.seed, check.seed + 1}
    assert len({trial.episode.script for trial in development}) == 2
    tables = [trial for sweep in planned_sweeps(recipe()) for trial in sweep.named()]
    assert not {trial.episode.script for trial in tables} & {trial.episode.script for trial in development}
    assert min(trial.episode.seed for trial in tables) > max(seeds)
