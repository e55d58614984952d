"""The exported skill beside the exported controller sees what the robot sees in the game, and commands the same."""

import json
import shutil
from contextlib import closing
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from iowbc.control.sensors import Measured
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import exported_folder
from iowbc.deploy.skill import CONTRACT, GOLDEN, GRAPH, Skill
from iowbc.deploy.timing import step_seconds
from iowbc.errors import ContractBroken
from iowbc.export.folder import write_skill
from iowbc.learning.networks import TeacherNetwork
from iowbc.recipe.reading.loading import load_recipe
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import robot_folder
from iowbc.skill.episodes import Plan
from iowbc.skill.game import TransportGame
from iowbc.skill.lower_layer import load_student
from iowbc.task.specification import Specification

ROOT = Path(__file__).parents[2]
PUBLISHED = ROOT / "runs" / "published"
DECISIONS = 4
ONE_PERIOD = 0.1
"""What a control period may change in an observation, 5 N or 1 cm, and in a command: the deployed skill sees the
command that was in force, the game
that which comes into force."""


@pytest.fixture(scope="module")
def controller(request: pytest.FixtureRequest) -> Controller:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("IOWBC_RUNS", str(ROOT / "runs"))
        return Controller.load(exported_folder("compliant_correlated"))


@pytest.fixture(scope="module")
def recipe() -> Recipe:
    return load_recipe(ROOT / "recipes" / "transport.yaml", ()).recipe


@pytest.fixture(scope="module")
def network(recipe: Recipe) -> TeacherNetwork:
    """A robot's policy that does a lot."""
    torch.manual_seed(0)
    network = TeacherNetwork(44 + 6 * recipe.skill.robot.history, 11, [16], "elu", 5.0)
    network.body.initialize(4.0, 2.0)
    return network.requires_grad_(False)


@pytest.fixture
def folder(tmp_path: Path, recipe: Recipe, network: TeacherNetwork, controller: Controller) -> Path:
    rows = np.random.default_rng(0).normal(size=(20, len(network.normalizer.mean))).astype(np.float32)
    sources = {"teacher": controller.contract.sources["teacher"]}
    assert write_skill(tmp_path, network, recipe, sources, rows) < 1e-5
    return tmp_path


def game_of(recipe: Recipe, controller: Controller) -> TransportGame:
    sources = controller.contract.sources
    rg, student = PUBLISHED / "rg-fit" / sources["rg-fit"], PUBLISHED / "teacher" / sources["teacher"]
    world = Specification(recipe, robot_folder(recipe.robot), rg).deployed
    return TransportGame(world, load_student(student), n=1, plans=[Plan("lift_straight", "path", known=False)])


def copied(source: Any) -> Measured:
    return Measured(**{field.name: np.array(getattr(source, field.name)) for field in fields(Measured)})


def test_skill_and_controller_do_what_the_game_does(
    folder: Path, recipe: Recipe, network: TeacherNetwork, controller: Controller
) -> None:
    skill = Skill.load(folder, controller)
    with closing(game_of(recipe, controller)) as game:
        seen, lower, measurements = game.reset(), game.batch.lower, []
        control = lower.control

        def watched() -> None:
            measurements.append(copied(lower.simulation.measured))
            control()

        lower.control = watched  # type: ignore[method-assign]
        controller.reset(scene="lift")
        human = np.zeros((1, 5), np.float32)
        for decision in range(DECISIONS):
            observation = seen.observations["robot"]
            measurements.clear()
            with torch.inference_mode():
                action = network(torch.from_numpy(observation)).clamp(-1, 1).numpy()
            assert np.abs(action).max() > 0.2
            seen = game.step({"robot": action, "human": human}).observed
            for place, measured in enumerate(measurements):
                command = skill.step(measured)
                if place == 0:
                    np.testing.assert_allclose(skill.observation, observation, atol=ONE_PERIOD, err_msg=f"{decision}")
                else:
                    np.testing.assert_allclose(command, lower.wanted, atol=ONE_PERIOD)
                targets = controller.step(measured, command)
                assert targets.reasons == ("",)


def test_a_reset_skill_remembers_nothing(folder: Path, recipe: Recipe, controller: Controller) -> None:
    with closing(game_of(recipe, controller)) as game:
        game.reset()
        measured = copied(game.batch.lower.simulation.measured)
    skill, commands = Skill.load(folder, controller), []
    for before in (0, 9):  # 9: in the middle of a decision
        for steps, moved in ((before, 0.1), (25, 0.0)):
            controller.reset(scene="lift")
            skill.reset()
            for step in range(steps):
                now = replace(measured, joint_position=measured.joint_position + moved + 1e-4 * step)
                command = skill.step(now)
                controller.step(now, command)
        commands.append(command)
    np.testing.assert_array_equal(*commands)


def test_golden_vectors_are_those_of_the_graph(folder: Path, network: TeacherNetwork) -> None:
    with np.load(folder / GOLDEN, allow_pickle=False) as golden, torch.inference_mode():
        expected = network(torch.from_numpy(golden["input/observation"])).clamp(-1, 1).numpy()
        np.testing.assert_allclose(golden["output/action"], expected, atol=1e-6)


def test_measurements_that_are_no_numbers_leave_the_command(folder: Path, controller: Controller) -> None:
    skill = Skill.load(folder, controller)
    upright = np.array([[0.0, 0.0, -1.0]])
    some: dict[str, Any] = {
        field.name: np.zeros(shape)
        for field, shape in zip(
            fields(Measured),
            [(1, 3), (1, 3), (1, 1), (1, 29), (1, 29), (1, 3), (1, 4), (1, 3), (1, 3)],
            strict=True,
        )
    }
    some |= {"projected_gravity": upright, "object_quaternion": np.array([[1.0, 0.0, 0.0, 0.0]])}
    standing = skill.step(Measured(**some | {"base_angular_velocity": np.full((1, 3), np.nan)}))
    assert np.isfinite(standing).all()
    with pytest.raises(ValueError, match="this skill observes the object"):
        Skill.load(folder, controller).step(Measured(**some | {"object_position": None}))


@pytest.mark.parametrize(("name", "value"), [("joint_position", 57.0), ("joint_velocity", np.nan)])
def test_one_bad_sample_does_not_change_what_the_skill_commands(
    folder: Path, recipe: Recipe, controller: Controller, name: str, value: float
) -> None:
    with closing(game_of(recipe, controller)) as game:
        game.reset()
        measured = copied(game.batch.lower.simulation.measured)
    commands = []
    for bad in (False, True):
        controller.reset(scene="lift")
        skill, steps = Skill.load(folder, controller), 30
        noise = 1e-3 * np.random.default_rng(0).standard_normal((steps, 29))
        for step in range(steps):
            now = replace(measured, joint_position=measured.joint_position + noise[step])
            if bad and step == steps // 2:
                values = getattr(now, name).copy()
                values[0, 20] = value
                now = replace(now, **{name: values})
            command = skill.step(now)
            controller.step(now, command)
        commands.append(command)
    np.testing.assert_allclose(commands[1], commands[0], atol=0.02)


@pytest.mark.parametrize("name", [GRAPH, GOLDEN])
def test_a_changed_file_is_refused(folder: Path, controller: Controller, name: str) -> None:
    (folder / name).write_bytes((folder / name).read_bytes() + b"x")
    with pytest.raises(ContractBroken, match="changed or damaged"):
        Skill.load(folder, controller)


def test_a_changed_contract_is_refused(folder: Path, controller: Controller) -> None:
    contract = json.loads((folder / CONTRACT).read_text())
    contract["robot"]["velocity"] = [10.0 * value for value in contract["robot"]["velocity"]]
    (folder / CONTRACT).write_text(json.dumps(contract))
    with pytest.raises(ContractBroken, match=r"differs from the contract with which skill\.onnx was made"):
        Skill.load(folder, controller)


def test_a_skill_of_another_controller_is_refused(
    tmp_path: Path, recipe: Recipe, network: TeacherNetwork, controller: Controller
) -> None:
    rows = np.zeros((2, len(network.normalizer.mean)), np.float32)
    write_skill(tmp_path, network, recipe, {"distill": "0" * 64}, rows)
    with pytest.raises(ContractBroken, match="trained with the student 0000"):
        Skill.load(tmp_path, controller)
    shutil.copy(tmp_path / GRAPH, tmp_path / CONTRACT)
    with pytest.raises(ContractBroken, match="not a contract"):
        Skill.load(tmp_path, controller)


def test_steps_of_both_are_timed_without_those_that_settle(
    folder: Path, controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("IOWBC_RUNS", str(ROOT / "runs"))
    decided: list[int] = []
    step = Skill.step
    monkeypatch.setattr(Skill, "step", lambda skill, measured: decided.append(1) or step(skill, measured))
    taken = step_seconds("compliant_correlated", 7, folder)
    assert taken.shape == (7, 2)
    assert (taken > 0.0).all()
    assert len(decided) == 8, "the first one settles, and is not among the seven"
