"""What is published with the repository belongs to the recipes that come with it: a fresh clone starts from it."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from iowbc.cli import app
from iowbc.deploy.controller import Controller

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("recipe", "last"), [("full", "eval"), ("teacher", "eval")])
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


def test_a_fresh_clone_has_a_controller_to_try(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("IOWBC_RUNS", str(ROOT / "runs"))
    controller = Controller.load("quickstart")
    assert controller.robot.name == "g1"
    folders = list((ROOT / "runs" / "published" / "export").iterdir())
    metrics = [json.loads((folder / "summary.json").read_text())["metrics"] for folder in folders]
    assert min(one["acceptance_survived"] for one in metrics) >= 4
