"""The same seed gives the same course, for any split over workers, and from any saved state."""

from collections.abc import Callable

import numpy as np
import pytest
from task_worlds import actions, rollout, same

from iowbc.task.vector.vector_env import VectorEnv

Make = Callable[..., VectorEnv]


def test_a_rollout_does_not_depend_on_the_number_of_workers(make: Make) -> None:
    courses = []
    for workers in (0, 1, 2, 3):
        env = make(num_envs=7, workers=workers)
        start = env.reset()
        courses.append(rollout(env, 60) | {"start": start} | env.drawn())
    assert courses[0]["done"].any()
    for course in courses[1:]:
        assert same(courses[0], course)


def test_a_rollout_over_mixed_scenes_does_not_depend_on_the_number_of_workers(make: Make) -> None:
    changes = {f"task.scenes.{name}": 0.25 for name in ("free", "lift", "tyre", "push")}
    courses = []
    for workers in (0, 1, 2):
        env = make(num_envs=8, workers=workers, changes=changes)
        start = env.reset()
        courses.append(rollout(env, 40) | {"start": start} | env.drawn())
    assert courses[0]["done"].any()
    for course in courses[1:]:
        assert same(courses[0], course)


OF_WHEELS = ("object_ground_friction", "rolling_resistance")
OF_OBJECTS = (
    *OF_WHEELS,
    *(
        "object_mass",
        "object_com_offset",
        "inertia_scale",
        "surface_friction",
        "link_object_force",
        "hand_weight_share",
    ),
    *("partner_share", "external_force", "external_torque"),
)


@pytest.mark.parametrize(("scene", "absent"), [("free", OF_OBJECTS), ("lift", OF_WHEELS)])
def test_what_the_teacher_sees_of_an_absent_object_is_zero(make: Make, scene: str, absent: tuple[str, ...]) -> None:
    changes = {"task.scenes.free": 0.0, "task.scenes.lift": 0.0, "simulation.impulses.interval.low": 0.2}
    env = make(num_envs=6, changes=changes | {f"task.scenes.{scene}": 1.0})
    rows = [env.reset()] + [env.step(actions(step, 6))[0] for step in range(60)]
    seen = np.stack(rows)[..., env.layout.privileged]
    for name in absent:
        assert not seen[..., env.layout.extra.slices[name]].any(), name


def test_an_environment_does_not_depend_on_its_company(make: Make) -> None:
    changes = {"task.scenes.free": 0.0}
    few, many = make(num_envs=2, changes=changes), make(num_envs=9, changes=changes)
    assert np.array_equal(few.reset(), many.reset()[:2])
    assert np.array_equal(rollout(few, 40)["observation"], rollout(many, 40)["observation"][:, :2])


def test_another_seed_gives_another_course(make: Make) -> None:
    assert not np.array_equal(make(seed=1).reset(), make(seed=2).reset())


def test_a_restored_environment_takes_bit_for_bit_the_same_course(make: Make) -> None:
    env = make(num_envs=6, workers=2)
    env.reset()
    rollout(env, 37)
    state = env.state()
    onward, figures = rollout(env, 60, start=37), env.statistics()
    env.restore(state)
    assert same(onward, rollout(env, 60, start=37))
    assert env.statistics() == figures


@pytest.mark.parametrize("workers", [0, 3])
def test_a_state_can_be_restored_into_another_number_of_workers(make: Make, workers: int) -> None:
    shares = {f"task.scenes.{name}": 0.25 for name in ("free", "lift", "tyre", "push")}
    source = make(num_envs=8, workers=2, changes=shares)
    source.reset()
    rollout(source, 23)
    state = source.state()
    target = make(num_envs=8, workers=workers, seed=99, changes=shares)
    target.restore(state)
    for start in range(23, 63, 10):
        assert same(rollout(source, 10, start=start), rollout(target, 10, start=start))
        one, other = source.state(), target.state()
        for name in one:
            np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def test_a_state_keeps_the_seeds_that_an_environment_was_given(make: Make) -> None:
    source, target = make(seed=1), make(seed=2)
    source.seed(5)
    source.reset()
    target.restore(source.state())
    target.seed(77)
    target.restore(source.state())
    assert np.array_equal(source.reset(), target.reset())


def test_a_state_of_other_environments_is_refused(make: Make) -> None:
    few, many = make(num_envs=2), make(num_envs=4)
    few.reset()
    many.reset()
    with pytest.raises(ValueError, match="expected 4"):
        many.restore(few.state())


GROUPS = {f"task.scenes.{name}": 0.25 for name in ("free", "lift", "tyre", "push")}


def test_copies_take_the_same_course_under_the_same_actions_until_their_episodes_end(make: Make) -> None:
    env = make(num_envs=32, changes=GROUPS, group=4)
    env.reset()
    rollout(env, 15)
    source = np.repeat(np.arange(2, 32, 4), 4)
    before = env.state()
    assert np.array_equal(env.copy(source), before["buffer/observation"][source])
    ended = np.zeros(32, np.bool_)
    for step in range(25):
        same_actions = np.repeat(actions(step, 8), 4, axis=0)
        observation, reward, done, _ = env.step(same_actions)
        alone = np.repeat((ended | done).reshape(-1, 4).any(axis=1), 4)
        assert np.array_equal(observation[~alone], observation[source][~alone])
        assert np.array_equal(reward[~ended], reward[source][~ended])
        ended |= done
    assert ended.any()
    assert not ended.all()
    keys = env.state()["task/episode_key"][ended]
    assert len(np.unique(keys)) == len(keys), "new episodes are their own"


def test_copies_do_not_depend_on_the_number_of_workers_and_leave_the_others_alone(make: Make) -> None:
    courses = []
    source = np.arange(32)
    source[4:8] = 5
    for workers in (0, 3):
        env = make(num_envs=32, workers=workers, changes=GROUPS, group=4)
        env.reset()
        rollout(env, 10)
        env.copy(source)
        courses.append(rollout(env, 30, start=10))
    assert same(*courses)
    env = make(num_envs=32, changes=GROUPS, group=4)
    env.reset()
    rollout(env, 10)
    alone = rollout(env, 30, start=10)
    untouched = np.setdiff1d(np.arange(32), [4, 6, 7])
    assert np.array_equal(alone["observation"][:, untouched], courses[0]["observation"][:, untouched])
    assert not np.array_equal(alone["observation"][:, 4], courses[0]["observation"][:, 4])


def test_groups_that_workers_would_split_are_refused(make: Make) -> None:
    with pytest.raises(ValueError, match="do not form groups of 4"):
        make(num_envs=24, group=4)
