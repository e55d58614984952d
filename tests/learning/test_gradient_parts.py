import threading
from typing import Any

import numpy as np
import pytest
import torch
from point_masses import MIRRORS, PointMasses

from iowbc.learning.computing import ParallelBatch, reduced
from iowbc.learning.ppo import Learner
from iowbc.learning.teacher import TeacherTraining
from iowbc.recipe.teacher import Teacher


@pytest.mark.parametrize("cores", [1, 2, 3])
def test_parts_come_back_in_their_order(cores: int) -> None:
    batch = torch.arange(10.0)[:, None]
    found = ParallelBatch(3, cores)(lambda part: part[:, 0].tolist(), batch)
    assert [value for part in found for value in part] == list(range(10))
    assert len(found) == 3


def test_two_cores_work_at_the_same_time() -> None:
    meeting = threading.Barrier(2, timeout=30.0)
    ParallelBatch(2, 2)(lambda part: meeting.wait(), torch.zeros(2, 1))


def test_what_is_learnt_does_not_depend_on_the_cores() -> None:
    def learnt(cores: int) -> dict[str, Any]:
        settings = Teacher(environments=8, rollout=16, minibatches=2, hidden=(16,), parts=3)
        training = TeacherTraining(Learner(settings, PointMasses(), MIRRORS, seed=3, cores=cores))
        for _ in range(3):
            training.update()
        return training.arrays()

    one, two = learnt(1), learnt(2)
    for name, value in one.items():
        np.testing.assert_array_equal(two[name], value, err_msg=name)


def test_threads_round_as_one_does_where_a_layer_is_used_twice() -> None:
    layers = torch.nn.ModuleList(torch.nn.Linear(64, 64) for _ in range(4))
    rows = torch.randn(256, 64, generator=torch.Generator().manual_seed(0))

    def gradient(part: torch.Tensor) -> torch.Tensor:
        with reduced("bfloat16"):
            ahead, image = part, part.flip(1)
            for layer in layers:
                ahead, image = torch.tanh(layer(ahead)), torch.tanh(layer(image))
        found = torch.autograd.grad((ahead + image).float().square().mean(), list(layers.parameters()))
        return torch.cat([each.flatten() for each in found])

    alone, together = ParallelBatch(4, 1), ParallelBatch(4, 4)
    expected = torch.stack(alone(gradient, rows))
    for _ in range(50):
        torch.testing.assert_close(torch.stack(together(gradient, rows)), expected, rtol=0.0, atol=0.0)


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a graphics card")
def test_a_graphics_card_learns_the_same() -> None:
    def learnt(device: str) -> dict[str, Any]:
        settings = Teacher(environments=8, rollout=16, minibatches=2, hidden=(16,), precision="float32")
        training = TeacherTraining(Learner(settings, PointMasses(), MIRRORS, seed=3, device=device))
        training.update()
        return training.arrays()

    one, two = learnt("cpu"), learnt("cuda")
    for name, value in one.items():
        np.testing.assert_allclose(two[name], value, atol=1e-4, err_msg=name)
