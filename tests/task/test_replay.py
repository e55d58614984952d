"""Failed episodes are played again until they are survived."""

from dataclasses import replace

import numpy as np
import pytest
from changes import changed

from iowbc.recipe.recipe import Recipe
from iowbc.task.episode_state import EpisodeState
from iowbc.task.judge import Ending
from iowbc.task.schedule import Schedule

COUNT = 3
EVERY = np.arange(COUNT)


@pytest.fixture
def schedule(recipe: Recipe):
    def make(replay: float) -> Schedule:
        task = changed(recipe, "task.curriculum.replay", replay).task
        memory = EpisodeState(COUNT, 14, 15)
        return Schedule(task, memory, environments=EVERY, seed=0, trials=None)

    return make


def ended(*fallen: bool) -> Ending:
    fell = np.array(fallen)
    return replace(Ending(*np.zeros((5, COUNT), bool)), fallen=fell, time_limit=~fell)


def test_an_episode_that_failed_is_played_again_until_it_is_survived(schedule) -> None:
    plan = schedule(1.0)
    first = plan.start(EVERY).copy()
    plan.promote(ended(True, False, True), EVERY)
    second = plan.start(EVERY).copy()
    assert (second == first).tolist() == [True, False, True]
    plan.promote(ended(True, True, False), EVERY)
    third = plan.start(EVERY).copy()
    assert third[0] == first[0], "it failed twice"
    assert third[1] == second[1]
    assert third[2] not in (first[2], second[2]), "it was survived"


def test_a_success_with_another_episode_leaves_the_failed_one_to_be_played(schedule) -> None:
    plan = schedule(0.5)
    first = plan.start(EVERY).copy()
    plan.promote(ended(True, True, True), EVERY)
    replayed = np.zeros(COUNT, bool)
    for _ in range(12):
        again = plan.start(EVERY).copy() == first
        replayed |= again
        plan.promote(ended(*again), EVERY)
    assert replayed.all()
    assert plan._memory.failed.all()


def test_without_replay_every_episode_is_new(schedule) -> None:
    plan, seen = schedule(0.0), set()
    for _ in range(5):
        seen |= set(plan.start(EVERY).tolist())
        plan.promote(ended(True, True, True), EVERY)
    assert len(seen) == 5 * COUNT
