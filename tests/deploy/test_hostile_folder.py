"""An exported folder that was made to deceive: sealed anew, with parts that are not what their names say."""

import io
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
import yaml
from own_parts import own_part

from iowbc.deploy.contract import Contract, read_contract, seal
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import CONTRACT
from iowbc.errors import ContractBroken
from iowbc.evaluation.exported import exported_world, golden_episode
from iowbc.robot.description import DESCRIPTION, robot_folder
from iowbc.task.vector.vector_env import VectorEnv


class Bomb:
    """What unpickles to a command."""

    def __reduce__(self) -> tuple[Any, ...]:
        return exec, ("raise SystemExit('it was executed')",)


def robot_yaml(**entries: Any) -> bytes:
    """The robot's description with other entries."""
    return yaml.safe_dump(yaml.safe_load((robot_folder("g1") / DESCRIPTION).read_text()) | entries).encode()


def pickled() -> bytes:
    file = io.BytesIO()
    np.savez(file, allow_pickle=True, pitch=np.array([Bomb()], dtype=object), low=np.zeros(1), high=np.zeros(1))
    return file.getvalue()


def sealed(exported: Path, place: Path, name: str, content: bytes) -> Path:
    folder = Path(shutil.copytree(exported, place))
    (folder / name).write_bytes(content)
    seal(Contract.model_validate_json((folder / CONTRACT).read_bytes()), folder)
    return folder


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("step.onnx", b"no graph"),
        ("step.onnx", b""),
        ("robot/g1.xml", b"<mujoco>"),
        ("robot/g1.xml", b"<mujoco/>"),
        ("robot/robot.yaml", b"[]"),
        ("robot/robot.yaml", b"!!python/object/apply:os.system [exit 1]"),
        ("robot/robot.yaml", b"mjcf: ../../../etc/passwd"),
        ("robot/robot.yaml", robot_yaml(mjcf="/dev/zero")),
        ("robot/robot.yaml", robot_yaml(mjcf="../contract.json")),
        ("robot/robot.yaml", robot_yaml(mjcf=3)),
        ("robot/robot.yaml", robot_yaml(joints=[3])),
        ("robot/g1.xml", b'<mujoco><include file="/dev/zero"/><worldbody/></mujoco>'),
        (
            "robot/g1.xml",
            b"<mujoco><worldbody>" + b"<body name='a'>" * 5000 + b"</body>" * 5000 + b"</worldbody></mujoco>",
        ),
        ("settle.onnx", b"no graph"),
    ],
)
def test_a_part_that_is_not_what_its_name_says_is_named(
    exported: Path, tmp_path: Path, name: str, content: bytes
) -> None:
    folder = sealed(exported, tmp_path / "folder", name, content)
    with pytest.raises(ContractBroken, match=r"cannot be used: .*; export again") as refused:
        Controller.load(folder)
    assert str(folder / Path(name).parts[0]) in str(refused.value)
    assert refused.value.exit_code == 2
    assert len(str(refused.value)) < 600


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("rg/feasible.npz", b""),
        ("rg/feasible.npz", pickled()),
        ("rg/rg.json", b"[]"),
        ("rg/rg.json", b"{"),
        ("rg/rg.safetensors", b""),
    ],
)
def test_a_generator_that_is_not_what_its_name_says_is_named_by_the_simulation(
    exported: Path, tmp_path: Path, name: str, content: bytes
) -> None:
    with pytest.raises(ContractBroken, match=r"rg: cannot be used: .*; export again"):
        exported_world(sealed(exported, tmp_path / "folder", name, content))


@pytest.mark.parametrize(
    "entries",
    [
        {"control_frequency": 0},
        {"control_frequency": -50},
        {"physics_frequency": 0},
        {"history": 0},
        {"kp": [1e999] * 29},
        {"kp": [300.0] * 29},
        {"control_frequency": 100.0},
        {"kp": [-1.0] * 29},
        {"upper": [-9.0] * 29},
        {"inputs": []},
        {"outputs": []},
        {"inputs": [{"name": "command", "shape": [10**9], "unit": "", "frame": "", "meaning": ""}]},
        {"description": "x" * 2_000_000},
    ],
)
def test_a_contract_that_no_export_writes_is_refused(exported: Path, tmp_path: Path, entries: dict[str, Any]) -> None:
    folder = Path(shutil.copytree(exported, tmp_path / "folder"))
    told = json.loads((folder / CONTRACT).read_text()) | entries
    (folder / CONTRACT).write_text(json.dumps(told))
    with pytest.raises(ContractBroken, match="export again"):
        Controller.load(folder)


@pytest.mark.parametrize("name", ["robot/g1.xml", "recipe.json", "rg/rg.json"])
def test_nothing_is_read_that_the_contract_has_no_digest_of(exported: Path, tmp_path: Path, name: str) -> None:
    folder = Path(shutil.copytree(exported, tmp_path / "folder"))
    told = json.loads((folder / CONTRACT).read_text())
    told["files"].pop(name)
    (folder / CONTRACT).write_text(json.dumps(told))
    with pytest.raises(ContractBroken, match=f"says nothing of {name}"):
        exported_world(folder)


def test_a_part_of_s_priv_in_a_users_file_is_not_executed(exported: Path, tmp_path: Path) -> None:
    values = json.loads((exported / "recipe.json").read_text())
    values["task"]["observation"]["own"] = {"mine": own_part(tmp_path, "raise SystemExit('it was executed')")}
    world = exported_world(sealed(exported, tmp_path / "folder", "recipe.json", json.dumps(values).encode()))
    VectorEnv(world, num_envs=1, workers=0, seed=0, episodes=[golden_episode(world.recipe)]).reset()


def test_a_graph_with_other_outputs_is_refused(exported: Path, tmp_path: Path) -> None:
    model = onnx.load(exported / "step.onnx")
    model.graph.output.pop()
    folder = sealed(exported, tmp_path / "folder", "step.onnx", model.SerializeToString())
    with pytest.raises(ContractBroken, match="outputs are"):
        Controller.load(folder)


@pytest.mark.parametrize("target", ["/dev/zero", "/etc", "nowhere"])
def test_a_link_to_what_is_no_file_is_missing(exported: Path, tmp_path: Path, target: str) -> None:
    folder = Path(shutil.copytree(exported, tmp_path / "folder"))
    (folder / "step.onnx").unlink()
    (folder / "step.onnx").symlink_to(target)
    with pytest.raises(ContractBroken, match=r"step\.onnx missing"):
        read_contract(folder)
