"""The student's networks and what they learn down."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from mirrored import mirror_tensor
from point_masses import MIRRORS, PointMasses

from iowbc.learning.distillation import DistillationLoss, Symmetry
from iowbc.learning.networks import StudentNetwork, TeacherNetwork, mirror_as_json
from iowbc.learning.storage import load_network, save_network
from iowbc.learning.student import Rows, StudentTraining
from iowbc.recipe.distillation import Distillation
from iowbc.robot.mirror import MirrorMap

OBSERVATION = MirrorMap(np.array([1, 0, 2, 3]), np.array([1, 1, -1, 1], np.float32))
ACTION = MirrorMap(np.array([1, 0, 2]), np.array([-1, -1, 1], np.float32))
FACTS = MirrorMap(np.array([0, 1]), np.array([1, -1], np.float32))


def architecture(symmetric: bool, history: int = 9) -> dict[str, Any]:
    mirrors = [mirror_as_json(OBSERVATION), mirror_as_json(ACTION)] if symmetric else None
    sizes = {"observation": 4, "history": history, "actions": 3, "frame_features": 8, "latent": 12, "hidden": [16]}
    return {**sizes, "activation": "elu", "clip": 10.0, "mirrors": mirrors}


def test_a_symmetric_student_commutes_with_the_mirror_of_every_observation() -> None:
    torch.manual_seed(0)
    network = StudentNetwork(**architecture(symmetric=True))
    history = torch.randn(40, 9, 4)
    with torch.no_grad():
        action, mirrored = network(history), network(mirror_tensor(OBSERVATION, history))
    torch.testing.assert_close(mirrored, mirror_tensor(ACTION, action), rtol=0, atol=1e-5)
    assert float((mirrored - action).abs().max()) > 1e-2, "the mirror does something"


@pytest.mark.parametrize("symmetric", [False, True])
def test_the_encoder_sees_the_oldest_observation_and_any_length_of_history(symmetric: bool) -> None:
    torch.manual_seed(0)
    for length in (1, 2, 9, 25):
        network = StudentNetwork(**architecture(symmetric, length))
        history = torch.randn(3, length, 4)
        changed = history.clone()
        changed[:, 0] += 5.0
        assert network(history).shape == (3, 3)
        assert not torch.allclose(network(history), network(changed))


@pytest.mark.parametrize("symmetric", [False, True])
def test_what_is_read_from_the_latent_is_mirrored_as_s_priv_is(symmetric: bool) -> None:
    torch.manual_seed(0)
    network = StudentNetwork(**architecture(symmetric), privileged=mirror_as_json(FACTS))
    assert network.estimate is not None
    for parameter in network.estimate.parameters():
        torch.nn.init.normal_(parameter)
    history = torch.randn(40, 9, 4)
    with torch.no_grad():
        told, seen = (network.estimate(network.read(h)[1]) for h in (history, mirror_tensor(OBSERVATION, history)))
        action, mirrored = network(history), network(mirror_tensor(OBSERVATION, history))
    assert told.shape == (40, 2)
    assert torch.allclose(seen, mirror_tensor(FACTS, told), atol=1e-5) == symmetric
    assert torch.allclose(mirrored, mirror_tensor(ACTION, action), atol=1e-5) == symmetric


def students_training(symmetry: Symmetry, **changes: Any) -> tuple[StudentTraining, TeacherNetwork]:
    """Of a teacher of unit masses that sees their distance, which the student does not."""
    torch.manual_seed(0)
    mirrors = [mirror_as_json(mirror) for mirror in MIRRORS] if symmetry == "construction" else None
    architecture = {"inputs": 3, "actions": 1, "hidden": [16], "activation": "elu", "clip": 10.0, "mirrors": mirrors}
    teacher = TeacherNetwork(**architecture)
    teacher.normalizer.mean[2], teacher.normalizer.std[2] = 0.5, 0.3
    seen = MirrorMap(MIRRORS[0].permutation[:2], MIRRORS[0].sign[:2])
    alone = MirrorMap(np.zeros(1, np.int64), np.ones(1, np.float32))
    withheld = np.array([0] if changes.get("withheld") else [], np.int64)
    rows = Rows(slice(0, 2), slice(2, 3), np.array([2]), withheld, seen, alone, alone, MIRRORS[1])
    settings = Distillation(
        environments=8,
        rollout=8,
        history=3,
        frame_features=8,
        latent=8,
        hidden=(16,),
        batch=64,
        buffer=512,
        steps=2560,
        learning_rate=2e-3,
    ).model_copy(update=changes)
    return StudentTraining(
        settings, PointMasses(), [teacher], np.zeros(8, int), architecture, rows, symmetry, seed=0
    ), teacher


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_a_student_begins_as_the_teacher_that_is_told_the_mean_and_learns_the_rest(symmetry: Any) -> None:
    training, teacher = students_training(symmetry)
    newest = torch.randn(20, 2)
    told = torch.cat([newest, torch.full((20, 1), 0.5)], dim=1)
    with torch.no_grad():
        torch.testing.assert_close(training.network(newest[:, None].repeat(1, 3, 1)), teacher(told))
    first, *_, last = [training.update()["action_rmse"] for _ in range(40)]
    assert last < 0.5 * first, (first, last)
    kept = {name: np.array(value) for name, value in training.arrays().items()}
    again, _ = students_training(symmetry)
    again.restore(kept)
    for name, value in again.arrays().items():
        np.testing.assert_array_equal(value, kept[name], err_msg=name)


def test_a_teacher_that_is_not_told_what_the_student_cannot_know_answers_as_the_student_begins() -> None:
    told, untold = (students_training("construction", withheld=withheld)[0] for withheld in ((), ("mass",)))
    assert untold.update()["action_rmse"] < 1e-6 < told.update()["action_rmse"]


def test_a_student_is_read_back(tmp_path: Path) -> None:
    about = architecture(symmetric=True)
    network = StudentNetwork(**about)
    save_network(network, about, tmp_path, "student", {})
    again, _ = load_network(tmp_path)
    history = torch.randn(5, 9, 4)
    torch.testing.assert_close(again(history), network(history), rtol=0, atol=0)


def loss(symmetry: Symmetry = "construction", **changes: Any) -> DistillationLoss:
    torch.manual_seed(0)
    settings = Distillation(latent=12).model_copy(update=changes)
    network = StudentNetwork(**architecture(symmetry == "construction"))
    return DistillationLoss(settings, torch.full((3,), math.log(0.3)), network, FACTS, ACTION, symmetry)


def test_at_a_shared_deviation_the_divergence_is_the_squared_error_over_twice_the_variance() -> None:
    learnt = loss(std="shared", auxiliary=0.0)
    histories, answers = torch.randn(6, 9, 4), torch.randn(6, 5)
    with torch.no_grad():
        error = ((learnt.network(histories) - answers[:, :3]) ** 2).sum(-1).mean()
        found, figures = learnt(histories, answers)
    assert math.isclose(float(found), float(error) / (2 * 0.3**2), rel_tol=1e-5)
    assert figures == {"kl_at_shared_std": pytest.approx(float(found))}
    assert not learnt.log_stds.requires_grad


def test_a_learnt_deviation_comes_to_rest_at_that_of_the_error_and_the_teacher_together() -> None:
    learnt = loss(auxiliary=0.0)
    histories = torch.randn(64, 9, 4)
    answers = torch.zeros(64, 5)
    with torch.no_grad():
        answers[:, :3] = learnt.network(histories)
        answers[:, 2] += torch.where(torch.arange(64) % 2 == 0, 0.4, -0.4)
    optimizer = torch.optim.Adam([learnt.log_stds], 0.05)
    for _ in range(200):
        optimizer.zero_grad()
        learnt(histories, answers)[0].backward()
        optimizer.step()
    expected = torch.tensor([0.3, 0.3, math.hypot(0.3, 0.4)])
    torch.testing.assert_close(learnt.log_std.exp().detach(), expected, rtol=1e-2, atol=0)
    assert learnt.log_stds.shape == (2,), "the mirror swaps the first two actions"


def test_the_deviation_keeps_above_its_floor() -> None:
    learnt = loss(std_floor=0.2)
    with torch.no_grad():
        learnt.log_stds.fill_(-9.0)
    assert float(learnt.log_std.exp().min().detach()) == pytest.approx(0.2)


@pytest.mark.parametrize("symmetry", ["construction", "none"])
def test_the_latent_learns_to_tell_what_depends_on_the_past(symmetry: Symmetry) -> None:
    learnt = loss(symmetry, auxiliary=1.0)
    optimizer = torch.optim.Adam(learnt.parameters(), 3e-3)
    errors = []
    for _ in range(250):
        histories = torch.randn(128, 9, 4)
        facts = torch.stack([histories[:, 0, 3], histories[:, 4, 0] - histories[:, 4, 1]], 1)
        total, figures = learnt(histories, torch.cat([torch.zeros(128, 3), facts], 1))
        optimizer.zero_grad()
        total.backward()
        optimizer.step()
        errors.append(figures["auxiliary_error"])
    assert np.mean(errors[-10:]) < 0.25 * np.mean(errors[:5])


def test_the_reader_of_a_symmetric_latent_mirrors_what_it_tells() -> None:
    learnt = loss()
    histories = torch.randn(20, 9, 4)
    with torch.no_grad():
        assert learnt.reader is not None
        told = learnt.reader(learnt.network.read(histories)[1])
        mirrored = learnt.reader(learnt.network.read(mirror_tensor(OBSERVATION, histories))[1])
    torch.testing.assert_close(mirrored, mirror_tensor(FACTS, told), rtol=0, atol=1e-5)
