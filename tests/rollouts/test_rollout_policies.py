"""Those who drive a rollout: alike for a part of the environments, and with a memory of what was before."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from iowbc.rollouts.policies import HistoryEncoder, HistoryPolicy, Layers, Linear, Normal, RowPolicy
from iowbc.rollouts.rollout import DaggerPolicy, ExploringPolicy, Past, RolloutPolicy

ENVIRONMENTS, LENGTH, STATE, TOLD, ACTIONS, BLOCK, STEPS = 10, 4, 3, 2, 2, 2, 6
ROUNDING = {"rtol": 1e-6, "atol": 1e-5}
"""Of sums of terms of about 30 in 32 bits, added in another order: a processor's own."""


def normal(*shape: int) -> Any:
    """Numbers that follow from the shape alone."""
    return np.random.default_rng(shape).normal(size=shape).astype(np.float32)


def linear(inputs: int, outputs: int) -> Linear:
    return Linear(normal(inputs, outputs), normal(outputs))


def scale(size: int) -> Normal:
    return Normal(normal(size), np.ones(size, np.float32), 5.0)


TEACHER = RowPolicy(scale(STATE + TOLD), Layers((linear(STATE + TOLD, 8), linear(8, ACTIONS)), "tanh"))
OTHER = RowPolicy(scale(STATE + TOLD), Layers((linear(STATE + TOLD, 8), linear(8, ACTIONS)), "tanh"))
STUDENT = HistoryPolicy(
    scale(STATE),
    HistoryEncoder(linear(STATE, 4), linear(4 * LENGTH, 6), "elu"),
    None,
    Layers((linear(STATE + 6, 8), linear(8, ACTIONS)), "relu"),
)
ROWS, ENDS = normal(STEPS + 1, ENVIRONMENTS, STATE + TOLD), np.random.default_rng(0).random((STEPS, ENVIRONMENTS)) < 0.3


def past() -> Past:
    return Past(normal(ENVIRONMENTS, LENGTH, STATE), np.arange(ENVIRONMENTS) % 3 == 0)


def explorer() -> ExploringPolicy:
    return ExploringPolicy(TEACHER, normal(STEPS, ENVIRONMENTS, ACTIONS), BLOCK)


def remembering() -> ExploringPolicy:
    return ExploringPolicy(STUDENT, normal(STEPS, ENVIRONMENTS, ACTIONS), BLOCK, past())


def apprentice() -> DaggerPolicy:
    return DaggerPolicy(
        student=STUDENT,
        teachers=(TEACHER, OTHER),
        teacher_of=(np.arange(ENVIRONMENTS) > 6).astype(int),
        observation=slice(0, STATE),
        privileged=slice(STATE, STATE + TOLD),
        masked=np.array([STATE + 1]),
        taught=np.arange(ENVIRONMENTS) < 4,
        block=BLOCK,
        past=past(),
    )


def driven(rollout_policy: RolloutPolicy, first: int = 0, last: int = ENVIRONMENTS) -> Any:
    """Actions of steps and what is recorded beside them."""
    own, starts = rollout_policy.part(first, last), rollout_policy.starts[first:last]
    found = []
    for step in range(STEPS):
        action, beside = own.act(step, ROWS[step, first:last], starts)
        found.append(np.concatenate([action, *beside.values()], axis=1))
        starts = ENDS[step, first:last]
    return np.stack(found)


@pytest.mark.parametrize("make", [explorer, remembering, apprentice])
def test_a_policy_acts_in_a_part_of_the_environments_as_it_does_among_all(make: Callable[[], RolloutPolicy]) -> None:
    rollout_policy = make()
    whole = driven(rollout_policy)
    np.testing.assert_array_equal(
        np.concatenate([driven(rollout_policy, 0, 4), driven(rollout_policy, 4, 10)], axis=1), whole
    )
    np.testing.assert_array_equal(driven(rollout_policy), whole, "a rollout leaves nothing in the policy")


def test_a_history_goes_on_where_the_rollout_before_ended() -> None:
    rollout_policy = remembering()
    assert rollout_policy.past is not None
    frames = rollout_policy.past.frames
    action, _ = rollout_policy.part(0, ENVIRONMENTS).act(0, ROWS[0], rollout_policy.starts)
    newest = ROWS[0, :, None, :STATE]
    seen = np.where(rollout_policy.starts[:, None, None], newest, np.concatenate([frames[:, 1:], newest], axis=1))
    np.testing.assert_allclose(action, STUDENT(seen) + rollout_policy.noise[0], **ROUNDING)


def test_the_teacher_drives_its_environments_and_answers_without_what_it_is_not_told() -> None:
    rollout_policy = apprentice()
    action, told = rollout_policy.part(0, ENVIRONMENTS).act(0, ROWS[0], rollout_policy.starts)
    np.testing.assert_array_equal(action[:4], told["answer"][:4])
    np.testing.assert_array_equal(action[4:], told["own"][4:])
    rows = ROWS[0].copy()
    rows[:, STATE + 1] = TEACHER.normal.mean[STATE + 1]
    first = rollout_policy.teacher_of == 0
    np.testing.assert_allclose(told["answer"][first], TEACHER(rows)[first], **ROUNDING)


def test_each_environment_is_answered_by_its_own_teacher() -> None:
    rollout_policy = replace(apprentice(), masked=np.zeros(0, int))
    _, recorded = rollout_policy.act(0, ROWS[0], rollout_policy.starts)
    for teacher, own in ((TEACHER, rollout_policy.teacher_of == 0), (OTHER, rollout_policy.teacher_of == 1)):
        assert own.any()
        np.testing.assert_allclose(recorded["answer"][own], teacher(ROWS[0])[own], **ROUNDING)
