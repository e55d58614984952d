"""Sole contact and support polygon, against worked examples."""

from typing import Any

import numpy as np
import pytest

from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.support_model import SoleLimits, SupportModel
from iowbc.robot.description import Robot

LIMITS = SoleLimits(friction=0.5 * np.sqrt(2.0), half_length=0.1, half_width=0.03, smallest_load=20.0)
"""The inner pyramid has the coefficient 0.5."""


def allowed(*wrench: float) -> bool:
    rows, bound = LIMITS.rows()
    return bool((rows @ np.array(wrench) <= bound + 1e-9).all())


@pytest.mark.parametrize(
    ("wrench", "holds"),
    [
        ((0, 0, 100, 0, 0, 0), True),
        ((49, 0, 100, 0, 0, 0), True),
        ((51, 0, 100, 0, 0, 0), False),
        ((0, -51, 100, 0, 0, 0), False),
        ((0, 0, 100, 2.9, 0, 0), True),
        ((0, 0, 100, 3.1, 0, 0), False),
        ((0, 0, 100, 0, -9.9, 0), True),
        ((0, 0, 100, 0, -10.1, 0), False),
        ((0, 0, 100, 0, 0, 6.4), True),
        ((0, 0, 100, 0, 0, 6.6), False),
        ((0, 0, 19, 0, 0, 0), False),
        ((0, 0, -100, 0, 0, 0), False),
    ],
)
def test_a_sole_carries_what_its_friction_and_rectangle_allow(wrench: Any, holds: bool) -> None:
    """Yaw torsion: μ f_z (x + y) = 0.5 · 100 · 0.13 = 6.5 N·m."""
    assert allowed(*wrench) is holds


def test_any_set_of_corner_forces_inside_the_pyramid_is_carried() -> None:
    random = np.random.default_rng(0)
    corners = np.array([[x, y, 0.0] for x in (-0.1, 0.1) for y in (-0.03, 0.03)])
    for _ in range(300):
        normal = random.uniform(6.0, 100.0, 4)
        tangent = 0.5 * normal[:, None] * random.uniform(-1.0, 1.0, (4, 2))
        force = np.column_stack([tangent, normal])
        wrench = np.concatenate([force.sum(axis=0), np.cross(corners, force).sum(axis=0)])
        assert allowed(*wrench)


def test_the_margin_is_the_distance_to_the_nearest_edge_of_both_soles(
    robot: Robot, recipe: ReferenceGenerator, support: SupportModel
) -> None:
    half = 0.5 * recipe.problem.stance_width + np.abs(robot.sole_polygon[..., 1]).max()
    front = robot.sole_polygon[..., 0].max()
    assert support.margin(np.zeros(2)) == pytest.approx(front, abs=2e-3)
    assert support.margin(np.array([front - 0.01, 0.0])) == pytest.approx(0.01, abs=1e-9)
    assert support.margin(np.array([0.05, half + 0.1])) < -0.05
    points = np.random.default_rng(0).normal(size=(5, 2))
    np.testing.assert_allclose(support.margin(points), [support.margin(point) for point in points])
