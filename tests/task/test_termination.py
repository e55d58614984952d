"""Falls and drops."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from iowbc.recipe.task.termination import Termination
from iowbc.task.endings import dropped, fallen

RECIPE = Termination()


def moved(**values: float) -> Any:
    """A motion of one environment, upright but for the given values."""
    upright = {"pelvis_height": 0.7, "pelvis_tilt": 0.0, "torso_roll": 0.0, "torso_pitch": 0.2}
    return SimpleNamespace(**{name: np.array([value]) for name, value in (upright | values).items()})


@pytest.mark.parametrize(
    ("values", "fell"),
    [
        ({}, False),
        ({"pelvis_height": 0.29}, True),
        ({"pelvis_tilt": 1.31}, True),
        ({"torso_roll": -0.81}, True),
        ({"torso_pitch": 1.11}, True),
        ({"torso_pitch": -0.71}, True),
        ({"torso_pitch": 1.09}, False),
    ],
)
def test_a_fall_is_a_base_or_torso_beyond_its_limits(values: dict[str, float], fell: bool) -> None:
    assert fallen(moved(**values), np.array([0.2]), RECIPE)[0] == fell


@pytest.mark.parametrize(
    ("offset", "held", "grasped", "lost"),
    [
        (0.0, True, (True, True), False),
        (0.0, True, (True, False), False),
        (0.0, True, (False, False), True),
        (0.36, True, (True, True), True),
        (0.36, False, (False, False), False),
    ],
)
def test_a_drop_is_an_object_out_of_both_hands_or_far_from_its_place(
    offset: float, held: bool, grasped: tuple[bool, bool], lost: bool
) -> None:
    motion: Any = SimpleNamespace(object_offset=np.array([[0.3 + offset, 0.0, 0.0]]))
    place = np.array([[0.3, 0.0, 0.0]])
    assert dropped(motion, place, np.array([held]), np.array([grasped]), RECIPE)[0] == lost
