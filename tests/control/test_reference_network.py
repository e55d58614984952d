"""The frozen network in NumPy: its arithmetic, its files, and what light processes import with it."""

import json
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iowbc.control.generator import ReferenceNetwork, input_names
from iowbc.robot.description import Robot


def make(random: Any, hidden: tuple[int, ...] = (8, 6)) -> ReferenceNetwork:
    sizes = [16, *hidden, 15]
    layers = [(random.normal(size=(o, i)), random.normal(size=o)) for i, o in pairwise(sizes)]
    single: dict[str, Any] = {
        "input_mean": random.normal(size=16),
        "input_std": random.uniform(0.5, 2.0, 16),
        "output_mean": random.normal(size=15),
        "output_std": random.uniform(0.1, 0.3, 15),
        "lower": np.full(15, -1.5),
        "upper": np.full(15, 1.5),
    }
    return ReferenceNetwork(
        inputs=tuple(f"input {i}" for i in range(16)),
        outputs=tuple(f"output {i}" for i in range(15)),
        layers=tuple((w.astype(np.float32), b.astype(np.float32)) for w, b in layers),
        **{name: value.astype(np.float32) for name, value in single.items()},
    )


@pytest.fixture
def network() -> ReferenceNetwork:
    return make(np.random.default_rng(0))


def test_it_computes_what_torch_computes(network: ReferenceNetwork) -> None:
    torch = pytest.importorskip("torch")
    random = np.random.default_rng(1)
    arms, base = random.normal(size=(7, 14)), random.normal(size=(7, 2))
    x = torch.tensor((np.concatenate([arms, base], axis=1) - network.input_mean) / network.input_std).float()
    for index, (weight, bias) in enumerate(network.layers):
        x = x @ torch.tensor(weight).T + torch.tensor(bias)
        x = torch.nn.functional.elu(x) if index < len(network.layers) - 1 else x
    expected = np.clip(x.numpy() * network.output_std + network.output_mean, network.lower, network.upper)
    np.testing.assert_allclose(network(arms, base), expected, atol=1e-5)


def test_references_keep_to_the_joint_limits(network: ReferenceNetwork) -> None:
    random = np.random.default_rng(2)
    reference = network(20.0 * random.normal(size=(50, 14)), random.normal(size=(50, 2)))
    assert reference.min() == -1.5
    assert reference.max() == 1.5


def test_wrong_inputs_are_answered_with_the_right_ones(network: ReferenceNetwork) -> None:
    with pytest.raises(ValueError, match=r"takes 16 inputs \(input 0, .*got 17"):
        network(np.zeros((1, 14)), np.zeros((1, 3)))


def test_it_comes_back_from_disk(network: ReferenceNetwork, tmp_path: Path) -> None:
    network.save(tmp_path)
    again = ReferenceNetwork.load(tmp_path)
    arms, base = np.random.default_rng(3).normal(size=(4, 14)), np.zeros((4, 2))
    np.testing.assert_array_equal(again(arms, base), network(arms, base))
    assert (again.inputs, again.outputs) == (network.inputs, network.outputs)


def test_an_empty_folder_is_answered_with_the_next_command(tmp_path: Path) -> None:
    with pytest.raises(
        FileNotFoundError, match=r"no rg\.json with rg\.safetensors; run `iowbc run RECIPE --until rg-fit`"
    ):
        ReferenceNetwork.load(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": 99}, "format 99.*reads format 1"),
        ({"activation": "relu"}, "activation 'relu'"),
        ({"hidden": [8, 7]}, "shapes do not fit"),
    ],
)
def test_a_description_that_does_not_fit_is_refused(
    network: ReferenceNetwork, tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    network.save(tmp_path)
    path = tmp_path / "rg.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(ValueError, match=message):
        ReferenceNetwork.load(tmp_path)


def test_numbers_that_are_not_finite_are_refused(network: ReferenceNetwork, tmp_path: Path) -> None:
    network.layers[0][0][0, 0] = np.nan
    network.save(tmp_path)
    with pytest.raises(ValueError, match="not finite"):
        ReferenceNetwork.load(tmp_path)


@pytest.mark.parametrize("height", ["pelvis", "com"])
def test_inputs_are_the_arms_the_height_and_the_torsos_pitch(robot: Robot, height: str) -> None:
    names = input_names(robot, height)
    assert names[:-2] == tuple(robot.joints[index] for index in robot.interaction)
    assert names[-2:] == (f"{height}_height", "torso_pitch")


def test_workers_of_the_simulation_import_nothing_heavy_with_it() -> None:
    code = (
        "import sys, iowbc.control.generator, iowbc.control.feasible_map;"
        "print([name for name in ('torch', 'pinocchio', 'crocoddyl', 'matplotlib', 'scipy') if name in sys.modules])"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
