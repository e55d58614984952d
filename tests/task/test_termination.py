"""Falls, drops and lagging behind."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from task_worlds import QUIET

from iowbc.recipe.task.task import Termination
from iowbc.task.judge import dropped, fallen, lagging, lost
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]
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


def test_a_crate_beside_the_hands_is_lost_where_the_recipe_says_so() -> None:
    motion: Any = SimpleNamespace(object_offset=np.array([[0.9, -0.6, 0.0], [0.9, -0.4, 0.0], [0.9, -0.6, 0.0]]))
    place, pushed = np.array([[0.4, 0.0, 0.0]] * 3), np.array([True, True, False])
    assert lost(motion, place, pushed, Termination(object_beside=0.5)).tolist() == [True, False, False]
    assert not lost(motion, place, pushed, RECIPE).any()


def test_lagging_ends_an_episode_only_where_the_command_can_be_followed() -> None:
    error, followable = np.array([-1.3, 1.1, 1.3, 1.3]), np.array([True, True, True, False])
    assert lagging(error, followable, RECIPE).tolist() == [True, False, True, False]
    assert not lagging(error, followable, Termination(heading_error=None)).any()


def test_a_robot_that_does_not_turn_ends_its_episode_by_lagging(make: Make) -> None:
    changes = {"task.scenes.lift": 0.0, "task.commands.standing_episodes": 0.0, "task.commands.standing_share": 0.0}
    env = make(changes=QUIET | changes | {"task.episode_duration": (9.0, 9.0), "task.termination.heading_error": 0.01})
    env.reset()
    for _ in range(40):
        _, _, done, infos = env.step(np.zeros((4, 15), np.float32))
        if done.any():
            break
    assert [infos[index]["end"] for index in np.flatnonzero(done)] == ["lagging"] * done.sum()
    assert done.any()
