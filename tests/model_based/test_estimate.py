"""The estimate of motion is right on average, also where the plan is not."""

from typing import Any

import numpy as np
import pytest

from iowbc.model_based.policy import Motion, motion_gains
from iowbc.recipe.evaluation.baselines import Estimation

PERIOD, JOINTS = 0.02, 2
UPRIGHT = np.array([0.0, 0.0, -1.0])


def at_rest() -> Motion:
    return Motion(UPRIGHT, np.zeros(JOINTS), motion_gains(JOINTS, PERIOD, Estimation()), PERIOD)


def followed(planned: float, made: float, noise: float, steps: int = 400) -> tuple[Any, Any]:
    """Rates of a joint that accelerates by `made` while `planned` was, [rad/s²]: estimated and true, (steps,)."""
    motion, random = at_rest(), np.random.default_rng(0)
    angle, rate, found, true = 0.0, 0.0, [], []
    for _ in range(steps):
        joints = angle + noise * 0.01 * random.normal(size=JOINTS)
        rates = np.concatenate([np.zeros(3), rate + noise * 0.5 * random.normal(size=JOINTS)])
        motion.correct(UPRIGHT, joints, rates)
        found.append(motion.rates[3])
        true.append(rate)
        motion.advance(np.concatenate([np.zeros(3), np.full(JOINTS, planned)]))
        angle, rate = angle + PERIOD * rate + 0.5 * PERIOD**2 * made, rate + PERIOD * made
    return np.array(found), np.array(true)


def test_a_motion_as_planned_is_followed_exactly() -> None:
    found, true = followed(planned=3.0, made=3.0, noise=0.0)
    np.testing.assert_allclose(found, true, atol=1e-9)


@pytest.mark.parametrize("planned", [0.0, 6.0])
def test_a_load_that_the_plan_does_not_know_leaves_no_bias(planned: float) -> None:
    found, true = followed(planned, made=3.0, noise=0.0)
    np.testing.assert_allclose(found[-50:], true[-50:], atol=1e-3)


def test_the_estimate_is_four_times_as_near_as_the_sensor() -> None:
    found, true = followed(planned=0.0, made=0.0, noise=1.0)
    assert np.std(found - true) < 0.25 * 0.5


def test_gravity_stays_a_direction_and_turns_with_the_base() -> None:
    motion = at_rest()
    motion.rates[1] = 0.5
    for _ in range(20):
        motion.advance(np.zeros(3 + JOINTS))
    pitch = 0.5 * 20 * PERIOD
    np.testing.assert_allclose(motion.gravity, [np.sin(pitch), 0.0, -np.cos(pitch)], atol=2e-3)
