"""Constrained least squares: worked examples and the conditions of an optimum."""

import numpy as np
import pytest

from iowbc.errors import Rejected
from iowbc.reference.labels.gauss_newton import constrained_step


def test_a_worked_example() -> None:
    """The point of the line x + y = 1 that is nearest to (3, 0) is (2, -1); with x ≤ 1.5 it is (1.5, -0.5)."""
    nearest = {
        "gradient": np.eye(2),
        "residual": np.array([-3.0, 0.0]),
        "equality": np.ones((1, 2)),
        "error": np.array([-1.0]),
        "rows": np.array([[1.0, 0.0]]),
        "lower": np.array([-10.0]),
    }
    np.testing.assert_allclose(constrained_step(**nearest, upper=np.array([10.0])), [2.0, -1.0], atol=1e-6)
    np.testing.assert_allclose(constrained_step(**nearest, upper=np.array([1.5])), [1.5, -0.5], atol=1e-6)


def test_no_feasible_direction_descends() -> None:
    random = np.random.default_rng(0)
    gradient, residual = random.normal(size=(12, 8)), random.normal(size=12)
    equality, error = random.normal(size=(3, 8)), random.normal(size=3)
    rows, bound = random.normal(size=(6, 8)), random.uniform(1.0, 2.0, 6)
    step = constrained_step(gradient, residual, equality, error, rows, -bound, bound)
    np.testing.assert_allclose(equality @ step, -error, atol=1e-9)
    assert (np.abs(rows @ step) <= bound + 1e-7).all()
    slope = gradient.T @ (gradient @ step + residual)
    for _ in range(500):
        direction = random.normal(size=8)
        direction -= np.linalg.pinv(equality) @ (equality @ direction)
        reached = rows @ (step + 1e-6 * direction)
        if (np.abs(reached) <= bound).all():
            assert slope @ direction > -1e-5


def test_contradicting_bounds_are_rejected() -> None:
    with pytest.raises(Rejected, match="infeasible"):
        constrained_step(
            np.eye(2), np.zeros(2), np.ones((1, 2)), np.array([-1.0]), np.eye(2), np.zeros(2), np.array([0.2, 0.2])
        )
