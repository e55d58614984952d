"""Levels move on survival and tracking, each environment for itself."""

from collections.abc import Callable

import numpy as np
import pytest
from task_worlds import actions

from iowbc.recipe.task.curriculum import Curriculum
from iowbc.task.curriculum import difficulty, initial_level, next_level
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]
RECIPE = Curriculum(rise=0.1, fall=0.05, early=0.5, tracking=0.6)


def moved(level: float, survived: bool, progress: float, tracking: float, recipe: Curriculum = RECIPE) -> float:
    arrays = (np.array([value]) for value in (level, survived, progress, tracking))
    return float(next_level(recipe, *arrays)[0])


def test_a_level_rises_only_on_survival_and_tracking_together() -> None:
    assert moved(1.0, True, 1.0, 0.7) == pytest.approx(1.1)
    assert moved(1.0, True, 1.0, 0.5) == 1.0
    assert moved(1.0, False, 0.9, 0.9) == 1.0


def test_a_level_falls_after_an_early_end_and_stays_within_its_limits() -> None:
    assert moved(1.0, False, 0.3, 0.9) == pytest.approx(0.95)
    assert moved(0.0, False, 0.1, 0.0) == 0.0
    assert moved(3.0, True, 1.0, 1.0) == 3.0


def test_without_a_curriculum_levels_stay() -> None:
    off = RECIPE.model_copy(update={"enabled": False, "fixed_level": 1.5})
    assert initial_level(off, 2).tolist() == [1.5, 1.5]
    assert moved(1.5, True, 1.0, 1.0, off) == 1.5


def test_phases_go_from_standing_with_light_loads_to_more_than_the_recipes_ranges() -> None:
    scales = difficulty(RECIPE, np.array([0.0, 1.0, 1.5, 2.0, 3.0]))
    assert scales.velocity.tolist() == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.6])
    assert scales.load.tolist() == pytest.approx([0.5, 1.0, 1.0, 1.0, 1.3])
    assert (np.diff(scales.disturbance) > 0).all()


def test_standing_where_walking_is_asked_for_does_not_raise_the_level(make: Make) -> None:
    changes = {"task.episode_duration": (0.4, 0.4), "task.commands.standing_share": 0.0, "task.scenes.lift": 0.0}
    env = make(changes=changes | {"task.commands.velocity_x": (0.5, 0.5), "task.commands.rates.velocity": 10.0})
    env.set_attr("level", 2.0)
    env.reset()
    tracked = []
    for _ in range(20):
        _, _, done, infos = env.step(np.zeros((4, 15), np.float32))
        tracked.append(env.signals["commanded_velocity"][:, 0].copy())
    assert done.all()
    assert all(info["TimeLimit.truncated"] for info in infos)
    assert np.mean(tracked) > 0.15
    assert env.get_attr("level") == [2.0] * 4


def test_each_environment_climbs_by_itself(make: Make) -> None:
    changes = {"task.episode_duration": (0.2, 0.2), "task.curriculum.tracking": 0.0, "task.curriculum.rise": 0.1}
    env = make(num_envs=4, changes=changes)
    env.reset()
    for _ in range(10):
        _, _, done, _ = env.step(np.zeros((4, 15), np.float32))
    assert done.all()
    env.set_attr("level", 0.7, indices=2)
    for _ in range(10):
        env.step(np.zeros((4, 15), np.float32))
    assert env.get_attr("level") == pytest.approx([0.2, 0.2, 0.8, 0.2])
    assert env.statistics()["curriculum_level"] == pytest.approx(np.mean([0.2, 0.2, 0.8, 0.2]))


def test_the_level_sets_load_and_disturbances(make: Make) -> None:
    env = make(num_envs=2)
    env.set_attr("level", 3.0, indices=1)
    env.reset()
    drawn = env.drawn()
    assert drawn["load_scale"].tolist() == pytest.approx([0.5, 1.3])
    assert drawn["impulse_scale"].tolist() == pytest.approx([0.0, 1.5])
    assert drawn["push_scale"].tolist() == pytest.approx([0.0, 1.5])


def test_environments_at_the_start_are_told_to_stand(make: Make) -> None:
    env = make(num_envs=6)
    env.reset()
    for step in range(60):
        env.step(actions(step, 6, 0.1))
        assert not env.signals["commanded_velocity"].any()
