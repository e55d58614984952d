"""Sole contact, support polygon and capsule distances, against worked examples and MuJoCo."""

from typing import Any

import mujoco
import numpy as np
import pinocchio
import pytest

from iowbc.recipe.generator import ReferenceGenerator
from iowbc.reference.labels.self_collision import SelfCollision, segment_distance
from iowbc.reference.labels.support_model import SupportModel
from iowbc.reference.labels.support_polygon import support_edges, support_margin
from iowbc.reference.labels.wrench_cone import SoleLimits
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


def test_the_margin_is_the_distance_to_the_nearest_edge_of_both_soles(robot: Robot, recipe: ReferenceGenerator) -> None:
    edges = support_edges(robot, recipe.problem)
    half = 0.5 * recipe.problem.stance_width + np.abs(robot.sole_polygon[..., 1]).max()
    front = robot.sole_polygon[..., 0].max()
    assert support_margin(edges, np.zeros(2)) == pytest.approx(front, abs=2e-3)
    assert support_margin(edges, np.array([front - 0.01, 0.0])) == pytest.approx(0.01, abs=1e-9)
    assert support_margin(edges, np.array([0.05, half + 0.1])) < -0.05
    points = np.random.default_rng(0).normal(size=(5, 2))
    np.testing.assert_allclose(support_margin(edges, points), [support_margin(edges, point) for point in points])


def test_segment_distances_are_those_of_a_fine_search() -> None:
    random = np.random.default_rng(1)
    a, b, c, d = random.normal(size=(4, 60, 3))
    b[:10], d[5:15] = a[:10], c[5:15]  # points
    d[20:25] = c[20:25] + (b - a)[20:25]  # parallel
    s = np.linspace(0.0, 1.0, 201)
    first = a[:, None] + s[:, None] * (b - a)[:, None]
    second = c[:, None] + s[:, None] * (d - c)[:, None]
    searched = np.linalg.norm(first[:, :, None] - second[:, None], axis=-1).min(axis=(1, 2))
    found = segment_distance(a, b, c, d)
    assert (found <= searched + 1e-12).all()
    np.testing.assert_allclose(found, searched, atol=5e-3)


def test_capsule_distances_are_mujocos(robot: Robot, support: SupportModel) -> None:
    collision = SelfCollision(robot)
    model = mujoco.MjModel.from_xml_path(str(robot.mjcf))
    data = mujoco.MjData(model)
    geoms = [model.geom(name).id for name in collision.names]
    random = np.random.default_rng(2)
    negative = 0
    for _ in range(40):
        joints = random.uniform(0.6 * robot.lower, 0.6 * robot.upper)
        data.qpos[:] = np.concatenate([[0, 0, 0, 1, 0, 0, 0], joints])
        mujoco.mj_kinematics(model, data)
        pinocchio.forwardKinematics(support.full, support.full_data, np.concatenate([[0, 0, 0, 0, 0, 0, 1], joints]))
        clearance, pair = collision.clearance(support.full_data.oMi)
        expected = min(mujoco.mj_geomDistance(model, data, geoms[a], geoms[b], 1.0, None) for a, b in collision.pairs)
        assert clearance == pytest.approx(expected, abs=2e-4), pair
        negative += clearance < 0.0
    assert 0 < negative < 40


def test_neighbours_in_the_chain_are_not_checked(robot: Robot) -> None:
    collision = SelfCollision(robot)
    names = {frozenset((collision.names[a], collision.names[b])) for a, b in collision.pairs}
    assert frozenset(("left_hand", "right_hand")) in names
    assert frozenset(("left_knee", "left_shin")) not in names
    assert frozenset(("left_elbow", "left_wrist_pitch")) not in names


def test_the_default_posture_touches_nothing(robot: Robot, support: SupportModel) -> None:
    q = np.concatenate([[0, 0, 0, 0, 0, 0, 1], robot.default_position])
    pinocchio.forwardKinematics(support.full, support.full_data, q)
    clearance, _ = SelfCollision(robot).clearance(support.full_data.oMi)
    assert clearance > 0.0
