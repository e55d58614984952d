import threading
from typing import Any

import numpy as np
import pytest
import torch
from point_masses import MIRRORS, PointMasses

from iowbc.learning.computing import SideBySide
from iowbc.learning.teacher import TeacherTraining
from iowbc.recipe.teacher import Teacher


@pytest.mark.parametrize("cores", [1, 2, 3])
def test_parts_come_back_in_their_order(cores: int) -> None:
    batch = torch.arange(10.0)[:, None]
    found = SideBySide(3, cores)(lambda part: part[:, 0].tolist(), batch)
    assert [value for part in found for value in part] == list(range(10))
    assert len(found) == 3


def test_two_cores_work_at_the_same_time() -> None:
    meeting = threading.Barrier(2, timeout=30.0)
    SideBySide(2, 2)(lambda part: meeting.wait(), torch.zeros(2, 1))


def test_what_is_learnt_does_not_depend_on_the_cores() -> None:
    def learnt(cores: int) -> dict[str, Any]:
        settings = Teacher(environments=8, rollout=16, minibatches=2, hidden=(16,), parts=3)
        training = TeacherTraining(settings, PointMasses(), MIRRORS, seed=3, cores=cores)
        for _ in range(3):
            training.update()
        return training.arrays()

    one, two = learnt(1), learnt(2)
    for name, value in one.items():
        np.testing.assert_array_equal(two[name], value, err_msg=name)
