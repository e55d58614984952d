"""The quadratic program in the simulation: it stands, each trial on its own, and goes through the stage `eval`."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from stage_jobs import make_job

from iowbc.evaluation.trials.plan import UNDISTURBED, command_script, planned_episode
from iowbc.evaluation.trials.protocol import evaluated_policy
from iowbc.evaluation.trials.rollout import PolicyInBatch, play_episodes
from iowbc.recipe.evaluation.sequences import STANDING
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder
from iowbc.stages import eval as evaluate
from iowbc.task.episodes import Episode
from iowbc.task.specification import Specification

RECIPE = Recipe.model_validate(
    {
        "name": "qp",
        "task": {"references": {"use_rg": False, "loads": {"lift": 0.0}}, "observation": {"observe_object": False}},
        "eval": {
            "policy": "model",
            "trials": 1,
            "lifting": {"masses": [1], "partner_shares": [0]},
            "sequence": [{"duration": 0.2, "ramp": 0.0}],
            "batch": 4,
            "video": {"count": 0},
        },
        "stages": ["eval"],
    }
)


def episodes(world: Specification, mass: float, count: int) -> list[Episode]:
    script = command_script(STANDING, world.recipe.task.commands)
    return [planned_episode("lift", script, mass, 6000 + number, UNDISTURBED) for number in range(count)]


@pytest.fixture
def world() -> Specification:
    return Specification(RECIPE, robot_folder("g1"))


def test_it_stands_for_six_seconds_without_a_load(world: Specification) -> None:
    outcomes = play_episodes(world, episodes(world, 0.0, 3), evaluated_policy(world, None), workers=0)
    for outcome in outcomes:
        assert outcome.survived, "randomised, with sensor noise and latencies"
        settled = outcome.trace.pelvis_height[100:] - outcome.trace.height_command[100:]
        assert np.abs(settled).mean() < 0.03


def test_a_trial_is_the_same_whichever_it_is_played_with(world: Specification) -> None:
    two = episodes(world, 1.0, 2)
    short = [replace(episode, duration=0.4) for episode in two]
    together = play_episodes(world, short, PolicyInBatch(evaluated_policy(world, None), 4, np.arange(2)), workers=0)
    alone = PolicyInBatch(evaluated_policy(world, None), 4, np.array([1]))
    (second,) = play_episodes(world, short[1:], alone, workers=0)
    np.testing.assert_array_equal(together[1].trace.joint_torque, second.trace.joint_torque)


def test_the_stage_plays_it_without_any_trained_policy(tmp_path: Path) -> None:
    assert evaluate.STAGE.reads(RECIPE) == ()
    assert not list(evaluate.problems(RECIPE))
    job = make_job(tmp_path, RECIPE)
    evaluate.run(job)
    assert set(pd.read_parquet(job.out / "trials.parquet")["policy"]) == {"model"}


def test_a_probe_of_it_is_refused_before_anything_runs() -> None:
    asked = Recipe.model_validate({**RECIPE.model_dump(), "eval": {"policy": "model", "probe": {}}})
    assert [place for place, _ in evaluate.problems(asked)] == ["eval.probe"]
