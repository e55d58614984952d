"""The stages of the skill layer, whole: what they leave, and that stopping and going on changes nothing."""

import json
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from changes import with_changes
from stage_jobs import make_job
from training_jobs import rows, small_recipe, stopped_and_resumed

from iowbc.deploy.skill import read_skill_contract
from iowbc.errors import StageFailed
from iowbc.recipe.recipe import Recipe
from iowbc.results.table import read_tables
from iowbc.stages import distill, skill, skill_eval, teacher
from iowbc.stages.registry import STAGES

GAMES, ROLLOUT = 4, 10
PUBLISHED = Path(__file__).parents[2] / "runs" / "published"


def transport(**changes: Any) -> Recipe:
    """Four updates of four games: two of imitation, one against scripted humans, one with the learnt one."""
    recipe, update = small_recipe(), GAMES * ROLLOUT
    settings = {
        "games": GAMES,
        "rollout": ROLLOUT,
        "steps": 4 * update,
        "imitation_steps": 2 * update,
        "imitation_gradient_steps": 2,
        "scripted_steps": 3 * update,
        "hidden": (8,),
        "minibatches": 2,
        "epochs": 1,
    }
    asked = {"tasks": ("lift_straight",), "partners": ("path", "agent"), "rivals": ("follow",), "episodes": 1}
    by_path: dict[str, Any] = {f"skill.learning.{name}": value for name, value in settings.items()}
    by_path |= {f"skill.eval.{name}": value for name, value in asked.items()}
    short = recipe.skill.tasks.lift_straight.model_copy(update={"duration": 1.0})
    by_path |= {"stages": ("teacher", "distill", "skill", "skill-eval"), "skill.tasks.lift_straight": short}
    return with_changes(recipe, by_path | changes)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A student, and a skill that was trained on it without a break."""
    place = tmp_path_factory.mktemp("trained")
    teacher.STAGE.run(make_job(place / "teacher", transport(), workers=0))
    found = {"teacher": place / "teacher" / "out"}
    distill.STAGE.run(make_job(place / "distill", transport(), inputs=found, workers=0))
    found = {"distill": place / "distill" / "out"}
    skill.STAGE.run(make_job(place / "skill", transport(), inputs=found, workers=0))
    return found | {"skill": place / "skill" / "out"}


def test_a_skill_that_was_stopped_and_resumed_is_the_unbroken_one_bit_for_bit(
    inputs: dict[str, Path], tmp_path: Path
) -> None:
    student = {"distill": inputs["distill"]}
    resumed = stopped_and_resumed(skill.STAGE, tmp_path, transport(), student)
    assert resumed.report.lines == ["resumed from its checkpoint at 40 of 160 steps"]  # type: ignore[attr-defined]
    for name in ("robot.safetensors", "human.safetensors", "skill.onnx"):
        assert (tmp_path / "out" / name).read_bytes() == (inputs["skill"] / name).read_bytes(), name
    assert rows(tmp_path / "work") == rows(inputs["skill"].parent / "work")


def test_the_skill_is_exported_with_what_it_was_trained_on(inputs: dict[str, Path]) -> None:
    contract = read_skill_contract(inputs["skill"])
    assert contract.sources["distill"] == inputs["distill"].name
    assert contract.frequency == 5.0
    assert json.loads((inputs["skill"] / "summary.json").read_text())["metrics"]["parity"] < 1e-5


def test_the_comparison_leaves_games_and_tables(inputs: dict[str, Path], tmp_path: Path) -> None:
    skill_eval.STAGE.run(make_job(tmp_path, transport(), inputs=inputs, workers=0))
    games = pd.read_parquet(tmp_path / "out" / "games.parquet")
    assert sorted(games.groupby(["label", "partner", "known"]).size()) == [1] * 8
    assert [table.name for table in read_tables(tmp_path / "out" / "tables")] == [
        "skill",
        "skill_partners",
        "skill_tasks",
    ]
    assert (tmp_path / "out" / "figures" / "skill_partners.png").is_file()


def test_the_skill_also_plays_on_the_published_controller_of_another_recipe(
    inputs: dict[str, Path], tmp_path: Path
) -> None:
    changes = {"skill.eval.controllers": {"WBC": "wbc.yaml"}, "skill.eval.masses": {"lift": (1.0, 4.0)}}
    recipe = transport(**changes | {"skill.eval.rivals": (), "skill.eval.known": (False,)})
    assert {name: one.stage for name, one in skill_eval.borrows(recipe).items()} == {
        "WBC/rg-fit": "rg-fit",
        "WBC/distill": "distill",
    }
    manifests = PUBLISHED.glob("distill/*/manifest.json")
    (wbc,) = (file.parent for file in manifests if json.loads(file.read_text())["recipe"] == "wbc")
    borrowed = {"WBC/distill": wbc, "WBC/rg-fit": next(PUBLISHED.glob("rg-fit/*"))}
    skill_eval.STAGE.run(make_job(tmp_path, recipe, inputs=inputs | borrowed, workers=0))
    games = pd.read_parquet(tmp_path / "out" / "games.parquet")
    assert games.groupby(["label", "mass"]).size().to_dict() == {
        (label, mass): 2 for label in ("MAPPO", "MAPPO on WBC") for mass in (1.0, 4.0)
    }
    own, other = (games[games["label"] == label]["tilt"].to_numpy() for label in ("MAPPO", "MAPPO on WBC"))
    assert (own != other).all()


def test_a_graph_that_differs_from_the_network_fails_the_stage(inputs: dict[str, Path], tmp_path: Path) -> None:
    strict = transport(**{"export.parity_tolerance": 1e-12})
    with pytest.raises(StageFailed, match="parity: the action differs"):
        skill.STAGE.run(make_job(tmp_path, strict, inputs={"distill": inputs["distill"]}, workers=0))


def test_what_no_student_or_nobody_carries_out_is_said_before_anything_runs() -> None:
    alone = transport(stages=("teacher", "skill", "skill-eval"))
    assert [path for name in alone.stages for path, _ in STAGES[name].problems(alone)] == ["stages", "stages"]
    wrong = transport(**{"skill.eval.tasks": ("lift_strait",), "skill.partners.training": ("path", "agent")})
    found = [text for name in wrong.stages for _, text in STAGES[name].problems(wrong)]
    assert len(found) == 2
    assert "learnt_share" in found[0]
    assert "no task 'lift_strait'" in found[1]
    alike = transport(**{"skill.eval.label": "admittance follower"})
    ((path, text),) = skill_eval.problems(alike)
    assert path == "skill.eval"
    assert "the rule `follow`" in text
    unfit = transport(**{"stages": ("teacher", "distill", "skill-eval"), "skill.eval.masses": {"push": (10.0,)}})
    unfit = with_changes(unfit, {"skill.eval.controllers": {"WBC": "wbc.yaml"}, "skill.eval.partners": ("path",)})
    assert [path for path, _ in skill_eval.problems(unfit)] == ["skill.eval.controllers", "skill.eval.masses.push"]


def test_followers_alone_have_no_game_in_which_only_the_human_knows_the_path() -> None:
    asked = {"skill.eval.partners": ("follower",), "skill.eval.known": (False,)}
    assert [place for place, _ in skill_eval.problems(transport(**asked))] == ["skill.eval"]
    assert list(skill_eval.problems(transport(**asked | {"skill.eval.known": (True,)}))) == []
