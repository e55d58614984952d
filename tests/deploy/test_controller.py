"""The exported controller: what it refuses, what it keeps, and that it needs no torch."""

import contextlib
import json
import os
import re
import shutil
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest

from iowbc.deploy import controller as controller_module
from iowbc.deploy.contract import Contract, read_contract, seal
from iowbc.deploy.controller import Controller, Measured
from iowbc.deploy.exported_folder import CONTRACT, STEP
from iowbc.errors import ContractBroken
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot

README = Path(__file__).parents[2] / "README.md"
EXAMPLE = README.parent / "examples" / "onnx_only.py"
NOMINAL = np.array([0, 0, 0, 0.72, 0, 0, 0, 0, 0, 0, 0.0])


def measured(robot: Robot, rows: int = 1, noise: float = 0.0) -> Measured:
    random = np.random.default_rng(0)
    return Measured(
        projected_gravity=np.tile([0.0, 0.0, -1.0], (rows, 1)),
        base_angular_velocity=noise * random.normal(size=(rows, 3)),
        heading=np.zeros((rows, 1)),
        joint_position=robot.default_position + noise * random.normal(size=(rows, 29)),
        joint_velocity=noise * random.normal(size=(rows, 29)),
        object_position=np.tile([0.3, 0.0, 0.1], (rows, 1)),
        object_quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        object_linear_velocity=np.zeros((rows, 3)),
        object_angular_velocity=np.zeros((rows, 3)),
    )


def test_a_step_gives_targets_for_every_joint_with_gains(exported: Path, robot: Robot) -> None:
    targets = Controller.load(exported).step(measured(robot), NOMINAL)
    assert targets.position.shape == (1, 29)
    assert np.isfinite(targets.position).all()
    assert np.array_equal(targets.kp, robot.kp)
    share_of_this_action = 0.7
    support = targets.support_reference + share_of_this_action * robot.action_scale * targets.action
    assert targets.position[:, robot.support] == pytest.approx(support, abs=1e-6)


def test_the_readme_shows_a_step_that_works(exported: Path, robot: Robot) -> None:
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(), flags=re.DOTALL)
    (snippet,) = [block for block in blocks if "Controller.load" in block]
    place = 'Controller.load("quickstart")'
    assert place in snippet
    names: dict[str, Any] = {}
    exec(snippet.replace(place, f"Controller.load({str(exported)!r})"), names)
    assert names["command"].shape == (11,)
    assert names["targets"].position.shape == (1, 29)
    assert np.array_equal(names["targets"].position, Controller.load(exported).step(measured(robot), NOMINAL).position)


def test_robots_side_by_side_do_not_touch_one_another(exported: Path, robot: Robot) -> None:
    both, alone = Controller.load(exported, robots=2), Controller.load(exported)
    commands = np.stack([NOMINAL, NOMINAL])
    commands[1, 0] = 0.4
    for time in range(10):
        pair = both.step(measured(robot, 2), commands, measured_at=time)
        one = alone.step(measured(robot), NOMINAL, measured_at=time)
    assert pair.position[0] == pytest.approx(one.position[0], abs=1e-6)
    assert np.abs(pair.position[1] - pair.position[0]).max() > 0.01


def test_reset_starts_over(exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported)
    walk = NOMINAL + np.eye(11)[0] * 0.3
    first = [controller.step(measured(robot, noise=0.1), walk, measured_at=time).position for time in range(10)]
    controller.reset()
    again = [controller.step(measured(robot, noise=0.1), walk, measured_at=time).position for time in range(10)]
    assert np.array_equal(first, again)
    assert not np.array_equal(first[0], first[-1]), "the gait clock runs"


def test_a_scene_has_its_own_grasp(exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported)
    arms = {}
    for scene in ("lift", "push"):
        controller.reset(scene=scene)
        arms[scene] = controller.step(measured(robot), NOMINAL).position[0, robot.interaction]
    assert np.abs(arms["lift"] - arms["push"]).max() > 0.05
    with pytest.raises(ValueError, match="known: free, lift"):
        controller.reset(scene="sofa")


def test_a_sudden_command_is_approached_at_the_rates_of_training(exported: Path, robot: Robot, recipe: Recipe) -> None:
    controller = Controller.load(exported)
    controller.step(measured(robot), NOMINAL)
    controller.step(measured(robot), NOMINAL + np.eye(11)[0])
    assert controller.state["command"][0, 0] == pytest.approx(recipe.task.commands.rates.velocity / 50)


def test_commands_are_clamped_to_the_feasible_map(exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported)
    controller.step(measured(robot), NOMINAL + np.eye(11)[3])
    assert controller.state["command"][0, 3] == pytest.approx(0.78)


@pytest.mark.parametrize("command", [np.zeros(10), np.zeros((3, 11))])
def test_commands_of_another_shape_are_refused(command: np.ndarray, exported: Path, robot: Robot) -> None:
    with pytest.raises(ValueError, match="command: expected shape"):
        Controller.load(exported).step(measured(robot), command)


def test_a_missing_measurement_is_refused(exported: Path, robot: Robot) -> None:
    blind = replace(measured(robot), object_position=None)
    with pytest.raises(ValueError, match="object_position: this policy needs it"):
        Controller.load(exported).step(blind, NOMINAL)


@pytest.mark.parametrize("which", [np.array([2]), [1, 0, 1], np.ones(2, bool), np.ones((3, 1), bool), True])
def test_a_reset_takes_a_boolean_for_each_robot_and_nothing_else(which: Any, exported: Path, robot: Robot) -> None:
    controller = Controller.load(exported, robots=3)
    controller.step(measured(robot, 3), NOMINAL)
    with pytest.raises(ValueError, match="expected a boolean for each of 3 robots"):
        controller.reset(which)
    assert controller.state["begun"].all()


@pytest.mark.parametrize("robots", [0, -1])
def test_fewer_than_one_robot_is_refused(robots: int, exported: Path) -> None:
    with pytest.raises(ValueError, match="expected 1 or more"):
        Controller.load(exported, robots=robots)


def files(exported: Path) -> list[str]:
    return [str(path.relative_to(exported)) for path in sorted(exported.rglob("*")) if path.is_file()]


def test_a_changed_file_is_noticed_whichever_it_is(exported: Path, tmp_path: Path) -> None:
    sealed = [name for name in files(exported) if name != CONTRACT]
    assert {STEP, "settle.onnx", "robot/robot.yaml", "robot/g1.xml", "rg/feasible.npz", "rg/rg.safetensors"} <= set(
        sealed
    )
    folder = shutil.copytree(exported, tmp_path / "changed")
    for name in sealed:
        whole = (folder / name).read_bytes()
        (folder / name).write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
        with pytest.raises(ContractBroken, match=f"{name}: SHA-256 is"):
            Controller.load(folder)
        (folder / name).write_bytes(whole)
    Controller.load(folder)


def test_an_incomplete_folder_is_named(exported: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(exported, tmp_path / "incomplete")
    for name in files(exported):
        whole = (folder / name).read_bytes()
        (folder / name).unlink()
        with pytest.raises(ContractBroken, match=f"{name} missing"):
            Controller.load(folder)
        (folder / name).write_bytes(whole)


def changed(exported: Path, place: Path, **entries: Any) -> Path:
    """A copy of the exported folder whose contract has other entries."""
    folder = shutil.copytree(exported, place)
    contract = json.loads((folder / CONTRACT).read_text())
    (folder / CONTRACT).write_text(json.dumps(contract | entries))
    return folder


def test_a_contract_of_another_format_is_refused(exported: Path, tmp_path: Path) -> None:
    with pytest.raises(ContractBroken, match=r"(?s)not a contract of format 4.*; export again"):
        read_contract(changed(exported, tmp_path / "earlier", format=3))


@pytest.mark.parametrize("entries", [{"format": 5}, {"format": 5, "joints": 3}, {"torque_limits": [1.0]}])
def test_a_contract_of_a_newer_version_is_called_that(exported: Path, tmp_path: Path, entries: dict[str, Any]) -> None:
    with pytest.raises(ContractBroken, match=r"made by a newer version of iowbc than \d.*install that here"):
        read_contract(changed(exported, tmp_path / "later", **entries))


@pytest.mark.parametrize(
    ("entry", "value", "message"),
    [
        ("kp", [100.0] * 28, "kp: 28 numbers"),
        ("kd", [float("nan")] * 29, "kd"),
        ("action_scale", [0.2], "action_scale: 1 numbers for 15 support joints"),
        ("support", [0, 1], "do not cover 29 joints"),
        ("files", {}, "says nothing of step.onnx"),
    ],
)
def test_numbers_that_do_not_fit_the_joints_are_refused(
    entry: str, value: Any, message: str, exported: Path, tmp_path: Path
) -> None:
    with pytest.raises(ContractBroken, match=message):
        read_contract(changed(exported, tmp_path / "wrong", **{entry: value}))


def test_every_constant_of_the_arms_is_in_the_contract(exported: Path, recipe: Recipe) -> None:
    references = read_contract(exported).references
    assert references == recipe.task.references
    assert {"damping", "reach", "longest_step", "posture_gain", "joint_speed"} <= set(
        type(references.arms).model_fields
    )


def test_the_contract_says_what_every_number_is(exported: Path) -> None:
    contract = read_contract(exported)
    assert len(contract.joints) == len(contract.kp) == 29
    assert [contract.joints[index] for index in contract.support][:3] == [
        "left_hip_pitch_joint",
        "left_hip_roll_joint",
        "left_hip_yaw_joint",
    ]
    assert all(port.unit and port.frame and port.meaning for port in (*contract.inputs, *contract.outputs))
    assert contract.control_frequency == 50
    assert contract.physics_frequency == pytest.approx(200)
    assert {"torch", "onnxruntime", "iowbc"} <= set(contract.versions)
    assert contract.state[-1].shape == (contract.history, sum(part.size for part in contract.observation))
    told = onnx.load(exported / STEP).metadata_props
    inside = Contract.model_validate_json(next(entry.value for entry in told if entry.key == "contract"))
    assert inside == contract.model_copy(update={"files": {}})


def test_the_controller_runs_without_torch_and_mujoco(exported: Path) -> None:
    program = (
        "import sys\n"
        "from pathlib import Path\n"
        "from iowbc.deploy.controller import Controller\n"
        f"Controller.load(Path({str(exported)!r}))\n"
        "heavy = {'torch', 'mujoco', 'pinocchio', 'mlflow', 'pandas', 'stable_baselines3'} & set(sys.modules)\n"
        "sys.exit(f'imported {heavy}' if heavy else 0)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_refused_step_leaves_the_controller_as_it_was(exported: Path, robot: Robot) -> None:
    tried, other = Controller.load(exported), Controller.load(exported)
    moving = NOMINAL + np.array([0.3, *[0.0] * 10])
    for controller in (tried, other):
        controller.step(measured(robot), moving)
    for name, value in {"object_position": None, "joint_position": np.zeros(3)}.items():
        with pytest.raises(ValueError, match=name):
            tried.step(replace(measured(robot), **{name: value}), moving)
    for _ in range(3):
        ours, theirs = (controller.step(measured(robot), moving) for controller in (tried, other))
        assert np.array_equal(ours.position, theirs.position)


def test_targets_that_are_no_numbers_are_not_passed_on(
    exported: Path, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    controller, graph = Controller.load(exported, robots=2), controller_module.run
    good = controller.step(measured(robot, 2), NOMINAL)

    def broken(session: Any, inputs: Any) -> Any:
        outputs = graph(session, inputs)
        for name in ("target", "action", "state_next"):
            outputs[name][1] = np.nan
        return outputs

    monkeypatch.setattr(controller_module, "run", broken)
    bad = controller.step(measured(robot, 2), NOMINAL)
    assert bad.held.tolist() == [False, True]
    assert np.array_equal(bad.position[1], good.position[1])
    monkeypatch.setattr(controller_module, "run", graph)
    again = controller.step(measured(robot, 2), NOMINAL)
    assert not again.held.any()
    assert np.isfinite(again.position).all()


def test_a_robot_that_starts_leaves_the_others_on_their_way(exported: Path, robot: Robot) -> None:
    both, alone = Controller.load(exported, robots=2), Controller.load(exported)
    reach = NOMINAL + np.eye(11)[5] * 0.1
    for controller, rows in ((both, 2), (alone, 1)):
        controller.step(measured(robot, rows), NOMINAL)
        controller.step(measured(robot, rows), reach)
    both.reset(np.array([False, True]))
    pair, one = both.step(measured(robot, 2), reach), alone.step(measured(robot), reach)
    assert pair.position[0] == pytest.approx(one.position[0], abs=1e-6)
    fresh = Controller.load(exported).step(measured(robot), reach)
    assert pair.position[1] == pytest.approx(fresh.position[0], abs=1e-6)
    assert np.abs(fresh.position - one.position).max() > 0.01


def test_weights_that_are_no_numbers_are_refused(exported: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(exported, tmp_path / "weights")
    model = onnx.load(folder / STEP)
    weights = next(tensor for tensor in model.graph.initializer if tensor.data_type == onnx.TensorProto.FLOAT)
    for tensor in model.graph.initializer:
        if tensor.data_type == onnx.TensorProto.FLOAT and len(tensor.raw_data) > len(weights.raw_data):
            weights = tensor
    weights.raw_data = np.full(len(weights.raw_data) // 4, np.nan, np.float32).tobytes()
    onnx.save(model, folder / STEP)
    seal(Contract.model_validate_json((folder / CONTRACT).read_text()), folder)
    with pytest.raises(ContractBroken, match="not finite: the weights are no numbers"):
        Controller.load(folder)


@pytest.mark.parametrize("name", ["../step.onnx", "/etc/passwd"])
def test_a_contract_that_names_files_outside_of_its_folder_is_refused(
    name: str, exported: Path, tmp_path: Path
) -> None:
    with pytest.raises(ContractBroken, match="outside of the folder"):
        read_contract(changed(exported, tmp_path / "outside", files={name: "0"}))


@pytest.mark.parametrize(
    "program",
    [
        "import iowbc\niowbc.Controller.load({folder!r})",
        "import runpy\nrunpy.run_path({example!r})['onnxruntime'].InferenceSession({folder!r} + '/step.onnx')",
    ],
    ids=["iowbc", "an example"],
)
def test_loading_a_controller_tells_nobody(exported: Path, tmp_path: Path, program: str) -> None:
    program = program.format(folder=str(exported), example=str(EXAMPLE)) + "\nimport time\ntime.sleep(1.0)\n"
    asked: list[str] = []
    with socket.create_server(("127.0.0.1", 0)) as proxy:
        proxy.settimeout(0.1)
        address = f"http://127.0.0.1:{proxy.getsockname()[1]}"
        places = {"http_proxy": address, "https_proxy": address, "HTTPS_PROXY": address, "TMPDIR": str(tmp_path)}
        environment = {name: value for name, value in os.environ.items() if name != "ORT_DISABLE_TELEMETRY"} | places
        running = subprocess.Popen([sys.executable, "-c", program], env=environment)
        while running.poll() is None:
            with contextlib.suppress(TimeoutError):
                asked.append(str(proxy.accept()[1]))
    assert running.returncode == 0
    assert asked == []
    assert list(tmp_path.iterdir()) == [], "the library's uploader keeps its session in TMPDIR"
