"""What an export takes along."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from exported_policies import untrained
from own_parts import own_part

from iowbc.export import folder as module
from iowbc.recipe.recipe import Recipe
from iowbc.robot.description import Robot


def test_an_export_takes_along_a_list_of_files_and_no_folder(
    recipe: Recipe, robot: Robot, rg: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sources = {"robot": tmp_path / "g1", "rg": tmp_path / "fitted"}
    for name, source in (("robot", robot.folder), ("rg", rg)):
        shutil.copytree(source, sources[name])
        (sources[name] / "password.txt").write_text("nobody is to read this")
    own = replace(robot, folder=sources["robot"], mjcf=sources["robot"] / robot.mjcf.name)
    monkeypatch.setattr(module, "write_onnx", lambda program, path, *rest: path.write_bytes(b"a graph"))
    (tmp_path / "out").mkdir()
    contract = module.write_folder(tmp_path / "out", untrained(recipe, own, sources["rg"]), recipe, sources["rg"], {})
    generator = {"rg/rg.json", "rg/rg.safetensors", "rg/feasible.npz"}
    assert (
        set(contract.files)
        == {"step.onnx", "settle.onnx", "recipe.json", "robot/robot.yaml", "robot/g1.xml"} | generator
    )
    assert not list((tmp_path / "out").rglob("password.txt"))


def test_a_part_of_s_priv_in_a_users_file_changes_nothing_in_an_export(
    recipe: Recipe, robot: Robot, rg: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "write_onnx", lambda program, path, *rest: path.write_bytes(b"a graph"))
    values = recipe.model_dump(mode="json")
    values["task"]["observation"]["own"] = {"mine": own_part(tmp_path)}
    found = []
    for name, one in (("without", recipe), ("with", Recipe.model_validate(values))):
        (tmp_path / name).mkdir()
        module.write_folder(tmp_path / name, untrained(one, robot, rg), one, rg, {})
        found.append({path.name: path.read_bytes() for path in (tmp_path / name).rglob("*.*") if path.is_file()})
    assert {"contract.json", "recipe.json"} < found[0].keys()
    assert found[0] == found[1]
