"""What is published with the repository belongs to the recipes that come with it: a fresh clone starts from it."""

import json
import shutil
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from iowbc.cli import app
from iowbc.commands.lookup import named
from iowbc.commands.playable import playable, skill_to_play
from iowbc.commands.publish import LARGEST_REPOSITORY
from iowbc.control.sensors import Measured
from iowbc.deploy.controller import Controller
from iowbc.errors import UsageError
from iowbc.evaluation.report.aggregate import aggregate
from iowbc.pipeline.store.runs import Runs, read_yaml
from iowbc.pipeline.store.store import Store
from iowbc.recipe.recipe import PIPELINE, Recipe
from iowbc.report.runs import grouped

ROOT = Path(__file__).parents[2]


PUBLISHED_TO = {
    "full": "export",
    "full_seed_1": "export",
    "teacher": "eval",
    "wbc": "eval",
    "wo_rg": "eval",
    "wo_distill": "eval",
    "blind": "export",
    "compliant_quick": "teacher",
    "compliant_wide": "teacher",
    "compliant_pace": "teacher",
    "compliant_steady": "teacher",
    "compliant_merged": "teacher",
    "compliant_merged_seed_1": "teacher",
    "compliant_merged_seed_2": "teacher",
    "compliant_correlated": "export",
    "compliant_correlated_seed_1": "eval",
    "compliant_correlated_seed_2": "eval",
    "drake": "teacher",
    "experts/quick": "distill",
    "experts/firm_push": "teacher",
    "scratch/push": "teacher",
    "specialists/push_student": "distill",
    "specialists/push": "teacher",
    "specialists/student": "distill",
    "transport": "skill-eval",
    "transport_all": "skill-eval",
    "transport_controllers": "skill-eval",
}


@pytest.mark.parametrize(("recipe", "last"), PUBLISHED_TO.items())
def test_a_fresh_clone_finds_the_stages_of_a_recipe_published(recipe: str, last: str, tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "published").symlink_to(ROOT / "runs" / "published")
    asked = ["plan", str(ROOT / "recipes" / f"{recipe}.yaml"), "--until", last, "--json"]
    done = CliRunner().invoke(app, [*asked, "--runs", str(tmp_path / "runs")])
    assert done.exit_code == 0, done.output
    (plan,) = json.loads(done.stdout)
    states = {stage["stage"]: stage["cached"] and stage["published"] for stage in plan["stages"]}
    assert all(states.values()), (states, plan["stages"])
    assert last in states


def test_every_published_artifact_is_sound_and_all_are_small() -> None:
    store = Store(Runs(ROOT / "runs"))
    for stage in PIPELINE:
        found = store.published(stage)
        assert len(found) == len(list((ROOT / "runs" / "published").glob(f"{stage}/*")))
        for artifact in found:
            artifact.verify()
    files = [path for path in store.runs.published.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) <= LARGEST_REPOSITORY


def test_this_version_reads_the_recipe_of_each_published_artifact() -> None:
    for file in sorted((ROOT / "runs" / "published").glob("*/*/recipe.yaml")):
        Recipe.model_validate(read_yaml(file))


def test_a_fresh_clone_makes_the_published_figures_from_the_published_trials() -> None:
    (table,) = (ROOT / "runs" / "published" / "eval").glob("*/tables/summary.csv")
    published = pd.read_csv(table)
    made = aggregate(pd.read_parquet(table.parents[1] / "trials.parquet")).to_csv(index=False, float_format="%.9g")
    pd.testing.assert_frame_equal(pd.read_csv(StringIO(made))[published.columns], published, rtol=1e-8)


def test_the_published_trainings_that_differ_in_their_seed_are_one_variant(tmp_path: Path) -> None:
    (tmp_path / "published").symlink_to(ROOT / "runs" / "published")
    found = [named(Store(Runs(tmp_path)), name) for name in ("full", "full_seed_1", "blind")]
    groups = grouped(found)
    assert [group.seeds for group in groups] == [("0", "1"), ("0",)]


def test_a_fresh_clone_has_a_controller_to_try(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "published").symlink_to(ROOT / "runs" / "published")
    monkeypatch.setenv("IOWBC_RUNS", str(tmp_path / "runs"))
    controller = Controller.load("quickstart")
    assert controller.robot.name == "g1"
    played = playable(Store(Runs(tmp_path / "runs")), "quickstart", None)
    assert (played.manifest.stage, played.manifest.recipe, played.published) == ("export", "quickstart", True)
    assert sum(path.stat().st_size for path in played.folder.rglob("*") if path.is_file()) < 1.5e6
    folders = list((ROOT / "runs" / "published" / "export").iterdir())
    metrics = [json.loads((folder / "summary.json").read_text())["metrics"] for folder in folders]
    assert min(one["acceptance_survived"] for one in metrics) >= 4


def test_what_was_published_without_weights_is_played_from_an_earlier_stage_or_refused(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "runs" / "published", tmp_path / "published")
    store = Store(Runs(tmp_path))
    store.publish(named(store, "full").artifacts["export"], ["settle.onnx", "step.onnx"])
    assert playable(store, "full", None).manifest.stage == "distill"
    with pytest.raises(UsageError, match=r"without settle.onnx, step.onnx; to make it anew: .* --force export"):
        playable(store, "full", "export")
    with pytest.raises(
        UsageError, match=r"teacher of compliant_pace came .* without teacher.json, teacher.safetensors"
    ):
        playable(store, "compliant_pace", None)


def test_a_fresh_clone_has_a_skill_whose_partner_one_can_be(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "published").symlink_to(ROOT / "runs" / "published")
    store = Store(Runs(tmp_path / "runs"))
    asked = [("transport", None), ("transport/skill", None), ("transport", "skill")]
    found = [skill_to_play(store, *one) for one in asked]
    assert all(one is not None and (one.manifest.stage, one.manifest.recipe) == ("skill", "transport") for one in found)
    for other in (("transport", "teacher"), ("full", None), ("nothing", None)):
        assert skill_to_play(store, *other) is None


def test_a_published_game_is_not_played_without_an_object(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "published").symlink_to(ROOT / "runs" / "published")
    done = CliRunner().invoke(app, ["play", "transport", "--mass", "0", "--runs", str(tmp_path / "runs")])
    assert isinstance(done.exception, UsageError)
    assert "a game has an object" in str(done.exception)


def test_a_fresh_clone_has_a_controller_that_needs_no_sight_of_the_object(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "published").symlink_to(ROOT / "runs" / "published")
    monkeypatch.setenv("IOWBC_RUNS", str(tmp_path / "runs"))
    controller = Controller.load("blind")
    measured = Measured(
        projected_gravity=np.array([[0.0, 0.0, -1.0]]),
        base_angular_velocity=np.zeros((1, 3)),
        heading=np.zeros((1, 1)),
        joint_position=controller.robot.default_position[None],
        joint_velocity=np.zeros((1, 29)),
    )
    targets = controller.step(measured, np.array([0, 0, 0, 0.72, 0, 0, 0, 0, 0, 0, 0.0]))
    assert not targets.held.any()
    assert np.abs(targets.position - controller.robot.default_position).max() < 1.0
