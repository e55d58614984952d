"""Public controllers in the trials: through the stage `eval`, in the carry bench, and as a recipe that names them."""

import hashlib
import json
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import yaml
from pages import write
from stage_jobs import make_job
from stand_ins import holosoma_file, linear
from typer.testing import CliRunner

from iowbc.adapters.holosoma import adapter as holosoma_adapter
from iowbc.adapters.source import load_adapter, policy_digest
from iowbc.cli import app
from iowbc.commands.bench import SUITES, carry, suite_digest
from iowbc.control.references import ReferenceLayer
from iowbc.evaluation.trials.plan import UNDISTURBED, command_script, planned_episode, planned_sweeps
from iowbc.evaluation.trials.protocol import evaluated_policy, evaluated_world
from iowbc.evaluation.trials.rollout import PolicyInBatch, play_episodes
from iowbc.recipe.evaluation.sequences import WALKING
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.reading.study import load_study
from iowbc.recipe.recipe import Recipe
from iowbc.recipe.section import deciding
from iowbc.recipe.task.joint_references import References
from iowbc.robot.description import Robot, robot_folder
from iowbc.stages import eval as evaluate
from iowbc.task.specification import Specification
from iowbc.task.vector.vector_env import VectorEnv

pytestmark = pytest.mark.integration

RECIPES = Path(__file__).parents[2] / "recipes"
SHORT: dict[str, Any] = {
    "trials": 1,
    "lifting": {"masses": [1], "partner_shares": [0]},
    "sequence": [{"duration": 0.2, "ramp": 0.0}],
    "batch": 4,
    "video": {"count": 0},
}


def recipe(file: Path, **evaluation: object) -> Recipe:
    public = {"adapter": "holosoma", "policy": str(file), "sha256": policy_digest(file)}
    references = {"use_rg": False, "upright": True, "gait": {"enabled": False}}
    return Recipe.model_validate(
        {
            "name": "walker",
            "task": {"references": references, "action": {"scale": 0.25, "bound": 20.0}},
            "eval": {"policy": "public", "public": public, **SHORT, **evaluation},
            "stages": ["eval"],
        }
    )


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return holosoma_file(tmp_path / "walker.onnx")


def test_its_key_hangs_on_its_digest_and_not_on_its_place(file: Path, tmp_path: Path) -> None:
    moved = deciding(recipe(file.rename(tmp_path / "moved.onnx")))
    other = deciding(recipe(holosoma_file(tmp_path / "other.onnx", kp=[50.0] * 29)))
    assert deciding(recipe(holosoma_file(file))) == moved != other


def test_the_stage_plays_it_without_any_trained_policy(file: Path, tmp_path: Path) -> None:
    asked = recipe(file)
    assert evaluate.STAGE.reads(asked) == ()
    assert not list(evaluate.problems(asked))
    job = make_job(tmp_path, asked)
    evaluate.run(job)
    trials = pd.read_parquet(job.out / "trials.parquet")
    assert set(trials["policy"]) == {"public"}
    assert np.isfinite(trials["E_v"]).all()


def test_its_robot_has_its_gains_and_starts_in_its_posture(file: Path) -> None:
    world = evaluated_world(Specification(recipe(file), robot_folder("g1")))
    script = command_script(WALKING, world.recipe.task.commands)
    episode = planned_episode("lift", script, 0.0, 5, UNDISTURBED)
    (outcome,) = play_episodes(world, [replace(episode, duration=0.1)], evaluated_policy(world, None), workers=0)
    assert world.robot != robot_folder("g1")
    assert yaml.safe_load((world.robot / "robot.yaml").read_text())["joints"]["knee"]["kp"] == 100.0
    assert np.abs(outcome.trace.action).max() < 1e-5, "a network of zeros asks for the posture that it starts in"


@pytest.mark.parametrize(
    ("arms", "moved"), [("measured", [False, False]), ("free", [True, False]), ("own", [True] * 2)]
)
def test_arms_of_its_own_go_to_the_posture_that_it_asks_for(file: Path, arms: str, moved: list[bool]) -> None:
    asked = recipe(file)
    assert asked.eval.public is not None
    public = asked.eval.public.model_copy(update={"arms": arms})
    asked = asked.model_copy(update={"eval": asked.eval.model_copy(update={"public": public})})
    world = evaluated_world(Specification(asked, robot_folder("g1")))
    script = command_script(WALKING, world.recipe.task.commands)
    episodes = tuple(planned_episode("lift", script, mass, 5, {}) for mass in (0.0, 1.0))
    environment = VectorEnv(world, num_envs=2, workers=0, seed=0, episodes=episodes)
    policy, seen = evaluated_policy(world, None), environment.reset()
    policy.reset(np.ones(2, np.bool_))
    environment.step(policy.act(seen[:, environment.layout.observation], seen[:, environment.layout.privileged]))
    robot, batch = environment.batch.robot, environment.batch
    own = holosoma_adapter(file)
    posture = [own.default[own.joints.index(robot.joints[joint])] for joint in robot.interaction]
    away = np.abs(batch.simulation.target[:, robot.interaction] - posture).max(axis=1)
    assert list(away < 1e-6) == moved


def test_a_trial_is_the_same_whichever_it_is_played_with(file: Path) -> None:
    world = evaluated_world(Specification(recipe(file), robot_folder("g1")))
    script = command_script(WALKING, world.recipe.task.commands)
    two = [replace(planned_episode("lift", script, 1.0, 6000 + number, {}), duration=0.4) for number in range(2)]
    together = play_episodes(world, two, PolicyInBatch(evaluated_policy(world, None), 4, np.arange(2)), workers=0)
    alone = PolicyInBatch(evaluated_policy(world, None), 4, np.array([1]))
    (second,) = play_episodes(world, two[1:], alone, workers=0)
    np.testing.assert_array_equal(together[1].trace.joint_torque, second.trace.joint_torque)


@pytest.mark.parametrize(
    ("changes", "place"),
    [({"policy": "model"}, "eval.public"), ({"public": None}, "eval.public"), ({"probe": {}}, "eval.probe")],
)
def test_what_does_not_belong_together_is_refused_before_anything_runs(
    file: Path, changes: Mapping[str, object], place: str
) -> None:
    assert [found for found, _ in evaluate.problems(recipe(file, **changes))] == [place]


def test_upright_references_leave_out_height_and_pitch(robot: Robot) -> None:
    references = References.model_validate({"use_rg": False, "upright": True})
    command = np.array([[0.3, 0.1, 0.2, 0.5, 0.6, *[0.01] * 6]])
    clamped = ReferenceLayer(robot, references, None).clamp(command)
    np.testing.assert_allclose(clamped[0, [0, 1, 2]], [0.3, 0.1, 0.2])
    assert clamped[0, 3] == pytest.approx(robot.default_height)
    assert clamped[0, 4] == pytest.approx(0.0, abs=1e-5)
    np.testing.assert_allclose(clamped[0, 5:], 0.01)


@pytest.fixture
def suites(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """The suites of the bench at the smallest size; MuJoCo stands in for Drake."""
    files = {engine: tmp_path / f"suite_{engine}.yaml" for engine in SUITES}
    for engine, written in files.items():
        lifting = SHORT["lifting"] | {"undisturbed": [], "with_share": [], "no_object": engine == "mujoco"}
        changes = SHORT | {"lifting": lifting, "scripts": None, "pushing": None}
        written.write_text(yaml.safe_dump({"extends": str(RECIPES / "public" / "carry.yaml"), "eval": changes}))
    monkeypatch.setattr("iowbc.commands.bench.SUITES", files)
    return files


def test_the_bench_writes_a_page_with_the_digests_of_controller_adapter_and_suite(
    file: Path, suites: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("iowbc.commands.bench.drake_version", lambda: "1.2.3")
    adapter, page = tmp_path / "mine.py", tmp_path / "page.md"
    adapter.write_text("from iowbc.adapters.holosoma import adapter\n")
    carry(str(file), str(adapter), workers=1, out=page)
    text = page.read_text()
    assert f"walker.onnx, SHA-256 {policy_digest(file)}" in text
    assert f"mine.py, SHA-256 {hashlib.sha256(adapter.read_bytes()).hexdigest()}" in text
    for label, engine, played in (("suite", "mujoco", 2), ("in Drake 1.2.3", "drake", 1)):
        digest = suite_digest(load_recipe(suites[engine]).recipe)
        assert f"| {label} | suite_{engine} of iowbc {version('iowbc')}, SHA-256 {digest}; {played} trials, 1 a" in text
    alone, lifted = text.split("| --- |\n")[-1].splitlines()[:2]
    assert alone.startswith("| lifting | no object | 1/1 |")
    assert alone.endswith("| – | – | – |"), "its suite in Drake has no such cell"
    assert "| 1/1 | 1/1 |" in lifted[-24:], "one engine stands in for the other, so that the outcomes are alike"


def test_every_trial_in_drake_is_one_of_the_bench() -> None:
    whole, cells = (load_recipe(RECIPES / "public" / file).recipe for file in SUITES.values())
    assert cells.eval.engine == "drake"
    planned, part = ([trial for sweep in planned_sweeps(one) for trial in sweep.named()] for one in (whole, cells))
    assert len(part) == 40
    assert all(trial in planned for trial in part)


@pytest.mark.usefixtures("suites")
def test_the_tutorial_plays_a_controller_of_ones_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("iowbc.commands.bench.drake_version", lambda: None)
    monkeypatch.chdir(tmp_path)
    write("tutorials/controller.md", tmp_path)
    policy = linear(tmp_path / "walker.onnx", np.zeros((15, 55), np.float32), np.zeros(15, np.float32))
    carry("walker.onnx", "my_adapter.py", posture=True, workers=1, out=Path("page.md"))
    page = Path("page.md").read_text()
    assert "height and pitch" in page
    assert "| in Drake | not installed: pip install '.[drake]' in a checkout |" in page
    (tmp_path / "recipes" / "public").symlink_to(RECIPES / "public")
    (tmp_path / "recipes" / "full.yaml").symlink_to(RECIPES / "full.yaml")
    digest = hashlib.sha256(policy.read_bytes()).hexdigest()
    own = load_recipe(tmp_path / "recipes" / "walker.yaml", [f"eval.public.sha256={digest}"]).recipe
    assert own.eval.public is not None
    assert load_adapter(own.eval.public).frequency == 50.0


def test_the_digest_of_a_suite_changes_with_its_trials_alone() -> None:
    file = RECIPES / "public" / "carry.yaml"
    plain, renamed, fewer = (
        suite_digest(load_recipe(file, changes).recipe) for changes in ([], ["eval.label=other"], ["eval.trials=9"])
    )
    assert plain == renamed != fewer


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["walker.onnx", "--adapter", "holosom"], "--adapter holosom: no such file; give a Python file, or one of"),
        (["walker.onnx", "--adapter", "holosoma"], "walker.onnx: is not there"),
        (["walker.onnx", "--adapter", "holosoma", "--out", "page.txt"], "a page is a Markdown file"),
        (["walker.onnx", "--adapter", "holosoma", "--engine", "both"], "--engine both: Drake is not installed: pip"),
    ],
)
def test_the_bench_says_what_is_wrong_before_it_plays(
    words: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("iowbc.commands.bench.drake_version", lambda: None)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, ["bench", "carry", *words])
    assert message in str(done.exception)


def test_the_shipped_recipe_names_two_walkers_in_the_trials_of_full() -> None:
    study = load_study(RECIPES / "public.yaml")
    assert len(study) == 2
    full = load_recipe(RECIPES / "full.yaml").recipe
    for one in study:
        asked = one.recipe
        assert asked.eval.public is not None
        assert (asked.simulation, asked.task.commands, asked.eval.scripts) == (
            *(full.simulation, full.task.commands),
            full.eval.scripts,
        )
        assert (asked.eval.seed, asked.eval.disturbances, asked.eval.success) == (
            *(full.eval.seed, full.eval.disturbances),
            full.eval.success,
        )


def test_a_plan_does_not_need_what_it_plays() -> None:
    done = CliRunner().invoke(app, ["plan", str(RECIPES / "public.yaml"), "--json"])
    assert done.exit_code == 0, done.output
    assert len(json.loads(done.stdout)) == 2


def test_a_training_does_not_move_the_arms_of_a_public_controller(tmp_path: Path) -> None:
    own = recipe(holosoma_file(tmp_path / "walker.onnx"))
    public = own.eval.public
    assert public is not None
    own = own.model_copy(
        update={"eval": own.eval.model_copy(update={"public": public.model_copy(update={"arms": "own"})})}
    )
    with closing(VectorEnv(Specification(own, robot_folder("g1")), num_envs=1, workers=0, seed=0)) as training:
        assert training.action_space.shape == (15,)
