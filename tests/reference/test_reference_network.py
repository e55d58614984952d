"""The frozen reference network: its function, its files, its symmetry."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iowbc.reference.dataset import Dataset
from iowbc.reference.network import ReferenceNetwork
from iowbc.reference.sampling import COMMAND_MIRROR
from iowbc.robot.description import Robot
from iowbc.robot.mirror import interaction_mirror, support_mirror
from iowbc.stages.contract import Job


def small_network(**changes: Any) -> ReferenceNetwork:
    """Two arm joints' worth of inputs and one output, with round numbers."""
    numbers: dict[str, Any] = {
        "inputs": ("a", "b", "c"),
        "outputs": ("x",),
        "layers": (
            (np.array([[1.0, 0.0, 0.0], [0.0, 1.0, -1.0]], dtype=np.float32), np.zeros(2, dtype=np.float32)),
            (np.array([[2.0, 1.0]], dtype=np.float32), np.array([0.5], dtype=np.float32)),
        ),
        "input_mean": np.array([1.0, 0.0, 0.0], dtype=np.float32),
        "input_std": np.array([2.0, 1.0, 1.0], dtype=np.float32),
        "output_mean": np.array([0.25], dtype=np.float32),
        "output_std": np.array([0.5], dtype=np.float32),
        "lower": np.array([-9.0], dtype=np.float32),
        "upper": np.array([9.0], dtype=np.float32),
    }
    return ReferenceNetwork(**{**numbers, **changes})


def test_the_function_is_the_one_worked_out_by_hand() -> None:
    output = small_network()(np.array([[5.0, 1.0]]), np.array([[2.0]]))
    hidden = 2.0, np.expm1(-1.0)
    np.testing.assert_allclose(output, [[(2.0 * hidden[0] + hidden[1] + 0.5) * 0.5 + 0.25]], rtol=1e-6)


def test_the_output_keeps_to_the_joint_limits() -> None:
    network = small_network(upper=np.array([1.0], dtype=np.float32))
    np.testing.assert_array_equal(network(np.array([[50.0, 1.0]]), np.array([[2.0]])), [[1.0]])


def test_a_wrong_number_of_inputs_is_named() -> None:
    with pytest.raises(ValueError, match=r"takes 3 inputs \(a, b, c\), got 4"):
        small_network()(np.zeros((1, 2)), np.zeros((1, 2)))


def test_a_network_survives_the_disk(tmp_path: Path) -> None:
    network = small_network()
    network.save(tmp_path)
    again = ReferenceNetwork.load(tmp_path)
    arms, base = np.random.default_rng(0).normal(size=(20, 2)), np.zeros((20, 1))
    np.testing.assert_array_equal(network(arms, base), again(arms, base))
    assert again.inputs == network.inputs


def test_missing_and_damaged_files_are_errors_that_say_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="--until rg-fit"):
        ReferenceNetwork.load(tmp_path)
    small_network(output_std=np.array([np.nan], dtype=np.float32)).save(tmp_path)
    with pytest.raises(ValueError, match="not finite"):
        ReferenceNetwork.load(tmp_path)
    small_network().save(tmp_path)
    architecture = json.loads((tmp_path / "rg.json").read_text())
    (tmp_path / "rg.json").write_text(json.dumps(architecture | {"hidden": [3]}))
    with pytest.raises(ValueError, match="shapes do not fit"):
        ReferenceNetwork.load(tmp_path)
    (tmp_path / "rg.json").write_text(json.dumps(architecture | {"format": 99}))
    with pytest.raises(ValueError, match="format 99"):
        ReferenceNetwork.load(tmp_path)


def test_the_fitted_network_names_its_inputs_and_outputs(fit_job: Job, robot: Robot) -> None:
    network = ReferenceNetwork.load(fit_job.out)
    arms = tuple(robot.joints[index] for index in robot.interaction)
    assert network.inputs == (*arms, "pelvis_height", "torso_pitch")
    assert network.outputs == tuple(robot.joints[index] for index in robot.support)


def test_the_fitted_network_is_nearly_symmetric(fit_job: Job, dataset_job: Job, robot: Robot) -> None:
    """Trained on mirror images, it differs from its own mirror image by less than it differs from the labels."""
    network, dataset = ReferenceNetwork.load(fit_job.out), Dataset.load(dataset_job.out / "dataset.npz")
    arms, legs = interaction_mirror(robot), support_mirror(robot)
    command = dataset.command
    plain = network(dataset.arm, command[:, :2])
    image = legs(network(arms(dataset.arm), (command * COMMAND_MIRROR)[:, :2]))
    asymmetry = np.sqrt(((plain - image) ** 2).mean())
    assert asymmetry < 0.5 * np.sqrt((dataset.support.std(axis=0) ** 2).mean())
    assert asymmetry < 2.0 * np.sqrt(((plain - dataset.support) ** 2).mean())
