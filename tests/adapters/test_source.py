"""Where a public controller comes from: place, digest, and the module of one's own."""

import hashlib
from pathlib import Path

import numpy as np
import onnx
import pytest
import torch
import yaml
from stand_ins import deploy_folder, holosoma_file, linear

from iowbc.adapters.networks import network
from iowbc.adapters.source import load_adapter, policy_digest, policy_path
from iowbc.errors import StageFailed
from iowbc.recipe.beside import ModuleFile
from iowbc.recipe.evaluation.baselines import PublicController
from iowbc.robot.g1_motors import MOTORS

pytestmark = pytest.mark.unit


def controller(policy: Path, **fields: object) -> PublicController:
    asked = {"adapter": "holosoma", "policy": str(policy), "sha256": policy_digest(policy)} | fields
    return PublicController.model_validate(asked)


def test_another_file_than_the_recipe_means_is_refused_with_its_digest(tmp_path: Path) -> None:
    file = holosoma_file(tmp_path / "walker.onnx")
    assert load_adapter(controller(file)).joints == MOTORS
    with pytest.raises(StageFailed, match=f"has the SHA-256 {policy_digest(file)}, the recipe expects 0000"):
        load_adapter(controller(file, sha256="0" * 64))


def test_a_package_that_is_not_installed_is_named_with_what_brings_it() -> None:
    with pytest.raises(StageFailed, match=r"needs the package no_such_package, which is not installed$"):
        policy_path("no_such_package:walker.onnx")
    assert policy_path("iowbc:__init__.py").is_file()
    with pytest.raises(StageFailed, match=r"walker\.onnx: is not there"):
        policy_path("iowbc:walker.onnx")


def test_the_wheel_that_is_missing_is_named_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("iowbc.adapters.source.find_spec", lambda name: None)
    with pytest.raises(StageFailed, match=r"needs the package holosoma_inference.*pip install '\.\[public\]'"):
        policy_path("holosoma_inference:models/walker.onnx")


def test_weights_in_another_file_are_refused_because_no_digest_covers_them(tmp_path: Path) -> None:
    graph = onnx.load(holosoma_file(tmp_path / "whole.onnx"))
    onnx.save_model(graph, tmp_path / "walker.onnx", save_as_external_data=True, location="rest", size_threshold=0)
    with pytest.raises(StageFailed, match=r"walker.onnx: keeps weights in another file, .* save it as one file"):
        policy_digest(tmp_path / "walker.onnx")


def test_the_digest_of_a_folder_is_that_of_its_sums(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "a").write_text("one")
    (tmp_path / "deep" / "b").write_text("two")
    sums = [(hashlib.sha256(b"one").hexdigest(), "a"), (hashlib.sha256(b"two").hexdigest(), "deep/b")]
    lines = "".join(sorted(f"{digest}  {name}\n" for digest, name in sums))
    assert policy_digest(tmp_path) == hashlib.sha256(lines.encode()).hexdigest()


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("from iowbc.adapters.holosoma import adapter", None),
        ("def adapter(policy):\n    return policy", "returned PosixPath; it takes the controller's pathlib.Path"),
        ("def adapter(policy):\n    raise KeyError('kp')", "raised KeyError: 'kp'"),
        ("def other(policy):\n    pass", "has no function 'adapter'"),
        ("import nothing_of_that_name", "cannot be executed: ModuleNotFoundError"),
    ],
)
def test_an_adapter_of_ones_own_is_executed_and_held_to_its_contract(
    tmp_path: Path, code: str, message: str | None
) -> None:
    file, module = holosoma_file(tmp_path / "walker.onnx"), tmp_path / "mine.py"
    module.write_text(code)
    own = controller(file, adapter="own", module=ModuleFile.taken_in(module, "mine.py"))
    if message is None:
        assert load_adapter(own).frequency == 50.0
        return
    with pytest.raises(StageFailed, match=message):
        load_adapter(own)


def test_a_module_belongs_to_the_adapter_own_alone() -> None:
    with pytest.raises(ValueError, match="belongs to the adapter 'own', which needs it"):
        PublicController(adapter="own", policy="walker.onnx", sha256="0" * 64)


def test_a_walker_of_holosoma_without_its_metadata_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StageFailed, match="its metadata lacks kp, which walkers of holosoma have"):
        load_adapter(controller(holosoma_file(tmp_path / "walker.onnx", kp=None)))


def test_gains_follow_the_motors_and_all_else_the_controllers_order(tmp_path: Path) -> None:
    order = [*range(1, 29), 0]
    adapter = load_adapter(controller(deploy_folder(tmp_path / "v0", order), adapter="deploy"))
    assert adapter.joints == tuple(MOTORS[motor] for motor in order)
    np.testing.assert_array_equal(adapter.kp, [100.0 + motor for motor in order])
    np.testing.assert_array_equal(adapter.kd, [1.0 + motor for motor in order])
    np.testing.assert_allclose(adapter.default, np.arange(29) / 100)
    assert (adapter.frequency, adapter.history, adapter.by_term) == (50.0, 2, True)
    assert adapter.ranges == {"v_x": (-0.5, 1.0), "v_y": (-0.3, 0.3), "yaw_rate": (-0.2, 0.2)}


def test_a_configuration_is_read_as_plain_yaml(tmp_path: Path) -> None:
    sliced = "joints: !!python/object/apply:builtins.slice [null, null, null]"
    assert load_adapter(controller(deploy_folder(tmp_path / "a", list(range(29)), sliced), adapter="deploy"))
    other = "joints: !!python/object/apply:os.system ['true']"
    with pytest.raises(StageFailed, match="cannot be read"):
        load_adapter(controller(deploy_folder(tmp_path / "b", list(range(29)), other), adapter="deploy"))


def test_an_observation_that_is_not_read_is_named(tmp_path: Path) -> None:
    folder = deploy_folder(tmp_path / "v0", list(range(29)))
    text = (folder / "deploy.yaml").read_text()
    (folder / "deploy.yaml").write_text(text.replace("last_action", "height_scan"))
    with pytest.raises(StageFailed, match="the observation 'height_scan' is not read; there are: base_ang_vel"):
        load_adapter(controller(folder, adapter="deploy"))


@pytest.mark.parametrize(
    ("entry", "value"), [("step_dt", 0), ("observations", {"concatenate": True}), ("joint_ids_map", [-1, *range(28)])]
)
def test_a_configuration_of_other_values_is_refused(tmp_path: Path, entry: str, value: object) -> None:
    folder = deploy_folder(tmp_path / "v0", list(range(29)))
    said = yaml.safe_load((folder / "deploy.yaml").read_text())
    (folder / "deploy.yaml").write_text(yaml.safe_dump(said | {entry: value}))
    with pytest.raises(StageFailed, match=r"deploy\.yaml describes no controller of joint positions"):
        load_adapter(controller(folder, adapter="deploy"))


def test_a_folder_with_two_networks_is_refused(tmp_path: Path) -> None:
    folder = deploy_folder(tmp_path / "v0", list(range(29)))
    holosoma_file(folder / "second.onnx")
    with pytest.raises(StageFailed, match=r"should be a folder with one \*.onnx, found .*policy.onnx, .*second.onnx"):
        load_adapter(controller(folder, adapter="deploy"))


@pytest.mark.filterwarnings("ignore:.*torch.jit.*:DeprecationWarning")
def test_torchscript_and_onnx_of_one_network_answer_alike(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    weight, bias = random.normal(size=(4, 6)).astype(np.float32), random.normal(size=4).astype(np.float32)
    layer = torch.nn.Linear(6, 4)
    layer.load_state_dict({"weight": torch.from_numpy(weight), "bias": torch.from_numpy(bias)})
    torch.jit.save(torch.jit.trace(layer, torch.zeros(1, 6)), tmp_path / "walker.pt")
    given = random.normal(size=(1, 6)).astype(np.float32)
    for path in (tmp_path / "walker.pt", linear(tmp_path / "walker.onnx", weight, bias)):
        np.testing.assert_allclose(network(path)(given), given @ weight.T + bias, atol=1e-6)


def test_a_network_that_is_none_is_refused(tmp_path: Path) -> None:
    for name in ("walker.onnx", "walker.pt", "walker.pkl"):
        (tmp_path / name).write_bytes(b"nothing")
        with pytest.raises(StageFailed, match=name):
            network(tmp_path / name)
