"""Compliance of the task: what velocity a force asks for, and what force should not have come to be."""

import numpy as np
import pytest
from task_worlds import rollout

from iowbc.recipe.task.reward import Yielding
from iowbc.task.episodes import CommandScript, CommandSegment, Episode
from iowbc.task.yielding import Admittance, excess_force

WALK = np.array([[0.5, 0.0]])
WALKING = (0.5, 0.0, 0.0, 0.72, *(0.0,) * 7)


def law(**changes):
    """The law of one robot that holds an object and one that pushes a crate."""
    return Admittance(Yielding(**changes), np.array([True, False]))


def test_the_paper_asks_for_the_commanded_velocity_whatever_the_force():
    rigid, command = law(), np.repeat(WALK, 2, axis=0)
    assert rigid.velocity(command, np.full((2, 2), -80.0)) == pytest.approx(command)


def test_a_force_beyond_the_margin_changes_the_velocity_by_its_part_of_the_damping():
    force = np.array([[-40.0, 0.0], [0.0, 150.0]])
    target = law(held=60.0, pushed=280.0).velocity(np.repeat(WALK, 2, axis=0), force)
    assert target == pytest.approx(np.array([[0.5 - 30.0 / 60.0, 0.0], [0.5, 140.0 / 280.0]]))


def test_a_force_within_the_margin_changes_nothing():
    command = np.repeat(WALK, 2, axis=0)
    assert law(held=60.0, pushed=280.0).velocity(command, np.full((2, 2), 7.0)) == pytest.approx(command)


def test_the_change_of_velocity_is_bounded():
    change = law(held=10.0, largest_speed=0.6).velocity(np.zeros((2, 2)), np.array([[0.0, -500.0]] * 2))
    assert change[0] == pytest.approx([0.0, -0.6])


def test_force_costs_beyond_what_stops_the_robot():
    settings = Yielding(held=60.0, pushed=280.0, margin=10.0, largest_force=100.0, force=-0.01)
    law = Admittance(settings, np.array([True] * 4))
    command = np.array([[0.5, 0.0], [0.5, 0.0], [0.0, 0.0], [0.0, 0.0]])
    force = np.array([[-40.0, 0.0], [-55.0, 0.0], [0.0, 25.0], [900.0, 0.0]])
    assert law.unyielded(command, force) == pytest.approx([0.0, 15.0, 15.0, 100.0])


def test_what_a_crate_needs_to_roll_is_not_excess():
    force = np.array([[-38.0, 0.0, 4.0], [-200.0, 0.0, 0.0], [-20.0, 0.0, 0.0]])
    command = np.array([[0.5, 0.0], [0.5, 0.0], [0.0, 0.0]])
    assert excess_force(force, command, np.array([38.0, 38.0, 38.0])) == pytest.approx(
        np.array([[0.0, 0.0], [-162.0, 0.0], [-20.0, 0.0]])
    )


def test_a_robot_that_a_blocked_crate_holds_back_is_asked_for_less_velocity(make) -> None:
    script = CommandScript((CommandSegment(0.2, (0.0, 0.0, 0.0, 0.72, *(0.0,) * 7)), CommandSegment(2.0, WALKING, 0.3)))
    episode = Episode("push", 5, 2.0, {"resistance_scale": 50.0, "partner_share": 0.0}, script)
    rewards = []
    for damping in (None, 280.0):
        env = make(num_envs=1, changes={"task.reward.yielding.pushed": damping}, episodes=[episode])
        env.reset()
        rollout(env, 90, size=0.0)
        rewards.append(env.statistics()["reward/sync.system_velocity"])
    assert rewards[1] > rewards[0] + 0.01
