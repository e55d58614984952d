"""Each axis of the curriculum moves by its own measure, each environment for itself, in the order of the phases."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from task_worlds import actions

from iowbc.recipe.task.curriculum import Curriculum
from iowbc.task.curriculum import AXES, EpisodeOutcome, difficulty, initial_levels, next_levels, phase, played_levels
from iowbc.task.episode_state import EpisodeState
from iowbc.task.judge import Ending
from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]
RECIPE = Curriculum(rise=0.1, fall=0.05)
YES, NO = np.array([True]), np.array([False])
WELL: Any = SimpleNamespace(
    survived=YES,
    progress_in_time=np.ones(1),
    posture=np.array([0.8]),
    walked=np.array([5.0]),
    covered=np.array([0.9]),
    heading=np.array([0.1]),
    infeasible=NO,
    stepping=NO,
    lagged=NO,
    disturbed=NO,
)


def replace(outcome: Any, **changes: Any) -> Any:
    assert changes.keys() <= vars(outcome).keys()
    return SimpleNamespace(**vars(outcome) | changes)


def test_the_outcomes_of_these_tests_have_the_fields_of_real_ones() -> None:
    memory = EpisodeState(1, 14, 15)
    memory.limit[:] = 1
    real = EpisodeOutcome(memory, Ending(*np.zeros((5, 1), np.bool_)), 0.02, 1.0)
    assert vars(WELL).keys() == vars(real).keys()


ENDED = replace(WELL, survived=NO, progress_in_time=np.array([0.3]))
LEVEL = {"posture": 0.5, "locomotion": 0.4, "load": 0.5, "disturbance": 0.2}


def moved(outcome: Any, level: dict[str, float] | None = None, recipe: Curriculum = RECIPE) -> dict[str, float]:
    """What an episode that was played at its own levels adds to each axis."""
    levels = np.array([list((level or LEVEL).values())])
    change = next_levels(recipe, levels, levels, outcome) - levels
    return dict(zip(AXES, change[0].round(9).tolist(), strict=True))


def test_every_axis_rises_after_an_episode_that_did_well_in_all() -> None:
    assert moved(WELL) == {"posture": 0.1, "locomotion": 0.1, "load": 0.1, "disturbance": 0.1}


def test_standing_where_walking_is_asked_for_raises_everything_but_locomotion_and_lowers_that() -> None:
    statue = moved(replace(WELL, covered=np.array([0.05])))
    assert statue == {"posture": 0.1, "locomotion": -0.05, "load": 0.1, "disturbance": 0.1}
    assert moved(replace(WELL, covered=np.array([0.4])))["locomotion"] == 0.0
    assert moved(replace(WELL, heading=np.array([0.9])))["locomotion"] == 0.0


def test_a_load_grows_only_where_it_was_carried_along() -> None:
    recipe = RECIPE.model_copy(update={"load_progress": 0.4})
    short = replace(WELL, covered=np.array([0.3]))
    assert moved(short, recipe=recipe) == {"posture": 0.1, "locomotion": 0.0, "load": 0.0, "disturbance": 0.1}
    assert moved(replace(short, walked=np.ones(1)), recipe=recipe)["load"] == 0.1
    assert moved(replace(short, infeasible=YES), recipe=recipe)["load"] == 0.1
    assert moved(WELL, recipe=recipe)["load"] == 0.1


def test_an_episode_without_walking_says_nothing_about_locomotion() -> None:
    assert moved(replace(WELL, walked=np.zeros(1), covered=np.ones(1)))["locomotion"] == 0.0


def test_bad_posture_raises_nothing_but_locomotion() -> None:
    assert moved(replace(WELL, posture=np.array([0.3]))) == {
        "posture": 0.0,
        "locomotion": 0.1,
        "load": 0.0,
        "disturbance": 0.0,
    }


@pytest.mark.parametrize(
    ("how", "blamed"),
    [
        ({"stepping": YES}, {"locomotion"}),
        ({"lagged": YES}, {"locomotion"}),
        ({"disturbed": YES, "stepping": YES}, {"disturbance"}),
        ({}, {"posture", "load"}),
    ],
)
def test_an_early_end_lowers_the_axes_that_are_to_blame(how: dict[str, Any], blamed: set[str]) -> None:
    change = moved(replace(ENDED, **how))
    assert change == {axis: -0.05 if axis in blamed else 0.0 for axis in AXES}


def test_a_late_end_lowers_nothing_and_levels_stay_within_their_limits() -> None:
    late = replace(ENDED, progress_in_time=np.array([0.9]), stepping=YES)
    assert set(moved(late).values()) == {0.0}
    assert set(moved(ENDED, dict.fromkeys(AXES, 0.0)).values()) == {0.0}
    assert set(moved(WELL, dict.fromkeys(AXES, 2.0)).values()) == {0.0}


def test_phases_open_one_after_the_other() -> None:
    recipe = RECIPE
    assert moved(WELL, LEVEL | {"disturbance": 0.3})["disturbance"] == 0.0, "phase 1 has no harder pushes"
    assert moved(WELL, LEVEL | {"locomotion": 0.45})["locomotion"] == pytest.approx(0.05)
    balanced = {"posture": 1.0, "locomotion": 0.5, "load": 1.0, "disturbance": 0.3}
    change = moved(WELL, balanced)
    assert change == {"posture": 0.0, "locomotion": 0.1, "load": 0.0, "disturbance": 0.1}
    assert set(moved(WELL, dict.fromkeys(AXES, 1.0)).values()) == {0.1}
    levels = np.array([list(LEVEL.values()), list(balanced.values()), [1.0] * 4])
    assert phase(recipe, levels).tolist() == [1, 2, 3]


def test_an_environment_that_falls_back_into_a_phase_keeps_what_it_had_reached() -> None:
    fallen_back = {"posture": 0.9, "locomotion": 0.8, "load": 1.0, "disturbance": 0.7}
    assert moved(WELL, fallen_back)["locomotion"] == 0.0
    assert moved(WELL, fallen_back)["posture"] == 0.1


def test_what_may_be_infeasible_is_promoted_by_posture_and_survival_alone() -> None:
    stuck = replace(WELL, covered=np.zeros(1), heading=np.array([1.0]))
    assert moved(replace(stuck, infeasible=YES))["locomotion"] == 0.1
    assert moved(stuck, dict.fromkeys(AXES, 1.5)) == dict.fromkeys(AXES, 0.1)
    assert moved(replace(stuck, posture=np.zeros(1)), dict.fromkeys(AXES, 1.5)) == dict.fromkeys(AXES, 0.0)


def test_walking_is_practised_with_loads_that_are_little_ahead_of_it() -> None:
    levels = np.array([[1.0, 0.2, 0.9, 0.3]] * 2)
    walking, standing = played_levels(RECIPE, levels, np.array([True, False]))
    assert walking.tolist() == pytest.approx([0.45, 0.2, 0.45, 0.3])
    assert standing.tolist() == levels[0].tolist()
    change = next_levels(RECIPE, levels[:1], walking[None], WELL) - levels[:1]
    assert change[0].tolist() == pytest.approx([0.0, 0.1, 0.0, 0.0])


def test_without_a_curriculum_levels_stay() -> None:
    off = RECIPE.model_copy(update={"enabled": False, "fixed_level": 1.5})
    assert initial_levels(off, 2).tolist() == [[1.5] * 4] * 2
    assert set(moved(WELL, LEVEL, off).values()) == {0.0}


def test_levels_go_from_light_loads_near_the_nominal_posture_to_more_than_the_recipes_ranges() -> None:
    levels = np.array([[0.0] * 4, [1.0] * 4, [1.5] * 4, [2.0] * 4])
    scales = difficulty(Curriculum(), levels)
    assert scales["velocity"].tolist() == pytest.approx([1.0, 1.0, 1.15, 1.3])
    assert scales["turning"].tolist() == pytest.approx([0.2, 1.0, 1.15, 1.3])
    assert scales["load"].tolist() == pytest.approx([0.15, 1.0, 1.15, 1.3])
    assert scales["disturbance"].tolist() == pytest.approx([0.0, 1.0, 1.25, 1.5])


def test_a_stepping_statue_does_not_climb(make: Make) -> None:
    changes = {"task.episode_duration": (0.5, 0.5), "task.commands.standing_share": 0.0, "task.scenes.lift": 0.0}
    changes |= {
        "task.commands.standing_episodes": 0.0,
        "task.commands.turning_share": 0.0,
        "task.curriculum.least_walk": 0.2,
        "task.curriculum.tracking": 0.0,
    }
    env = make(
        changes=changes
        | {"task.commands.rates.velocity": 10.0, "task.curriculum.progress": 1.0, "task.curriculum.lagging": 1.0}
    )
    env.set_attr("level", {"locomotion": 0.3})
    env.reset()
    for _ in range(25):
        _, _, done, infos = env.step(np.zeros((4, 15), np.float32))
    assert done.all()
    assert all(info["TimeLimit.truncated"] for info in infos)
    for level in env.get_attr("level"):
        assert level["locomotion"] == pytest.approx(0.2)
        assert level["posture"] == pytest.approx(0.08)


def test_each_environment_climbs_by_itself(make: Make) -> None:
    changes = {"task.episode_duration": (0.2, 0.2), "task.curriculum.tracking": 0.0, "task.curriculum.rise": 0.1}
    env = make(num_envs=4, changes=changes | {"task.commands.standing_episodes": 1.0})
    env.reset()
    for _ in range(10):
        _, _, done, _ = env.step(np.zeros((4, 15), np.float32))
    assert done.all()
    env.set_attr("level", {"load": 0.7}, indices=2)
    for _ in range(20):
        env.step(np.zeros((4, 15), np.float32))
    assert [level["load"] for level in env.get_attr("level")] == pytest.approx([0.3, 0.3, 0.8, 0.3])
    figures = env.statistics()
    assert figures["level/load"] == pytest.approx(np.mean([0.3, 0.3, 0.8, 0.3]))
    assert figures["level/locomotion"] == 0.0


def test_the_levels_set_load_and_disturbances(make: Make) -> None:
    env = make(num_envs=2, changes={"task.commands.standing_episodes": 1.0, "task.scenes.free": 0.0})
    env.set_attr("level", 2.0, indices=1)
    with pytest.raises(ValueError, match="no axis 'speed'; there are posture, locomotion, "):
        env.set_attr("level", {"speed": 1.0})
    env.reset()
    drawn = env.drawn()
    assert drawn["load_scale"].tolist() == pytest.approx([0.15, 1.3])
    assert drawn["resistance_scale"][0] == 0.5
    assert drawn["resistance_scale"][1] in (3.0, 50.0)
    assert drawn["impulse_scale"].tolist() == pytest.approx([0.0, 1.5])
    assert drawn["push_scale"].tolist() == pytest.approx([0.0, 1.5])


def test_two_of_three_steps_walk_from_the_first_episode_on(make: Make) -> None:
    env = make(num_envs=48, changes={"task.scenes.lift": 0.0, "task.episode_duration": (1.0, 1.0)})
    env.reset()
    walking = []
    for step in range(150):
        env.step(actions(step, 48, 0.1))
        walking.append(env.signals["commanded_velocity"].any(axis=1).mean())
    assert 0.6 < np.mean(walking) < 0.8


def test_at_the_highest_level_three_of_ten_pushes_and_more_cannot_be_made_and_the_share_is_told(make: Make) -> None:
    env = make(num_envs=64, changes={f"task.scenes.{name}": float(name == "push") for name in ("free", "lift", "push")})
    env.set_attr("level", 2.0)
    for seed in range(4):
        env.seed(seed)
        env.reset()
    share = env.statistics()["infeasible_pushes"]
    assert 0.3 <= share < 0.7
    env.set_attr("level", 1.0)
    env.reset()
    assert env.statistics()["infeasible_pushes"] < 0.02
