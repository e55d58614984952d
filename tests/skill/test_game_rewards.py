"""Endings, reward and figures."""

from dataclasses import replace

import numpy as np
import pytest

from iowbc.recipe.skill.skill import Skill
from iowbc.skill.outcomes import GameEnding, ending, internal_force, potential, reward
from iowbc.skill.situation import GameState

N = 5
SKILL = Skill()


def at(**values: object) -> GameState:
    """Games whose object is at rest on its path, but for some values."""
    nothing = {name: np.zeros(N) for name in GameState.__dataclass_fields__}
    return replace(GameState(**nothing), **{name: np.broadcast_to(value, N) for name, value in values.items()})


def judged(now: GameState, **happened: object) -> GameEnding:
    flags = {name: np.broadcast_to(happened.get(name, False), N) for name in ("fallen", "dropped", "diverged")}
    return ending(
        SKILL,
        now,
        held=np.broadcast_to(happened.get("held", True), N),
        happened=np.stack([flags["fallen"], flags["dropped"], flags["diverged"]]),
        late=np.broadcast_to(happened.get("late", False), N),
    )


def test_success_needs_the_end_of_the_path_the_path_the_yaw_and_of_held_objects_the_height() -> None:
    finish = SKILL.finish
    now = at(
        left=[0.1, 2 * finish.distance, 0.1, 0.1, 0.1],
        lateral=[0.0, 0.0, 1.1 * finish.lateral, 0.0, 0.0],
        yaw_error=[0.0, 0.0, 0.0, -1.1 * finish.yaw, 0.0],
        height_error=[0.0, 0.0, 0.0, 0.0, 2 * finish.height],
    )
    assert judged(now).success.tolist() == [True, False, False, False, False]
    assert judged(now, held=False).success.tolist() == [True, False, False, False, True]


def test_a_game_ends_for_one_reason() -> None:
    end = judged(
        at(lateral=[0.0, 0.0, 0.0, 2.0, 0.0], left=1.0), fallen=[1, 1, 0, 0, 0], dropped=[1, 0, 1, 0, 0], late=True
    )
    reasons = np.stack([getattr(end, name) for name in GameEnding.__dataclass_fields__])
    assert (reasons.sum(axis=0) == 1).all()
    assert (end.terminated == [True, True, True, True, False]).all()


def test_the_potential_is_what_is_covered_less_the_errors_and_a_way_there_and_back_gains_nothing() -> None:
    held = np.ones(N, np.bool_)
    start, aside = at(covered=1.0), at(covered=1.5, lateral=-0.2, yaw_error=0.1, height_error=0.05)
    weights = SKILL.reward
    gained = potential(SKILL, aside, held) - potential(SKILL, start, held)
    expected = 0.5 * weights.progress - 0.2 * weights.path - 0.1 * weights.yaw - 0.05 * weights.height
    assert gained == pytest.approx(np.full(N, expected))


def test_costs_lower_the_reward_and_a_diverged_simulation_costs_nothing() -> None:
    calm, nothing = judged(at(left=1.0)), np.zeros(N)
    idle = reward(SKILL, nothing, calm, np.zeros((3, N)), nothing, np.zeros(N, np.bool_))
    strained = reward(SKILL, nothing, calm, np.full((3, N), 2.0), nothing + 0.1, np.ones(N, np.bool_))
    assert (strained < idle).all()
    fell = reward(SKILL, nothing, judged(at(left=1.0), fallen=True), np.zeros((3, N)), nothing, np.zeros(N, np.bool_))
    assert fell == pytest.approx(idle - SKILL.reward.failure)
    lost = reward(SKILL, nothing + 5.0, judged(at(), diverged=True), np.zeros((3, N)), nothing, np.zeros(N, np.bool_))
    assert (lost == 0.0).all()


def test_the_internal_force_is_what_cancels() -> None:
    robot = np.array([[20.0, 0.0], [20.0, 0.0], [0.0, 10.0], [3.0, 4.0]])
    partner = np.array([[30.0, 0.0], [-12.0, 0.0], [0.0, -10.0], [0.0, 0.0]])
    assert internal_force(robot, partner) == pytest.approx([0.0, 12.0, 10.0, 0.0], abs=1e-12)
