"""Paths: their geometry, and where objects are on them."""

import math

import numpy as np
import pytest

from iowbc.recipe.skill.task import Stretch
from iowbc.skill.situation import SPACING, Paths

ARC = (Stretch(length=math.pi, turn=math.pi / 2.0, width=1.0), Stretch(length=1.0, rise=0.2))
"""A quarter of a circle of 2 m radius to the left, then 1 m on, which rises."""
ONE = np.zeros(1, np.int64)


@pytest.fixture(scope="module")
def paths() -> Paths:
    return Paths([ARC, (Stretch(length=0.3),)])


def test_an_arc_ends_where_its_circle_does(paths: Paths) -> None:
    end = paths.point(ONE, np.array([math.pi]))[0]
    assert end == pytest.approx([2.0, 2.0], abs=1e-3)
    assert paths.heading(ONE, np.array([math.pi]))[0] == pytest.approx(math.pi / 2.0, abs=0.03)
    assert paths.curvature(ONE, np.array([1.0]))[0] == pytest.approx(0.5, abs=1e-6)


def test_a_place_is_the_way_along_the_path_and_the_distance_to_its_left(paths: Paths) -> None:
    way, left = 1.0, 0.2
    angle = way / 2.0
    inside = np.array([[(2.0 - left) * math.sin(angle), 2.0 - (2.0 - left) * math.cos(angle)]])
    covered, lateral = paths.place(ONE, inside, np.array([0.8]))
    assert covered[0] == pytest.approx(way, abs=0.01)
    assert lateral[0] == pytest.approx(left, abs=1e-3)


def test_a_place_stays_on_the_stretch_it_was_on(paths: Paths) -> None:
    near_the_start = np.array([[0.1, 0.0]])
    assert paths.place(ONE, near_the_start, np.array([4.0]))[0][0] > 3.0


def test_height_rises_along_a_stretch_and_walls_end_with_theirs(paths: Paths) -> None:
    assert paths.height(ONE, np.array([math.pi + 0.5]))[0] == pytest.approx(0.1, abs=0.02)
    assert paths.half_width(ONE, np.array([1.0]))[0] == 0.5
    assert np.isinf(paths.half_width(ONE, np.array([math.pi + 0.5]))[0])
    _, walls = paths.outline(0)
    assert np.linalg.norm(walls[0, 10] - walls[1, 10]) == pytest.approx(1.0)


def test_a_path_ends_at_its_own_end_beside_longer_ones(paths: Paths) -> None:
    short = np.ones(1, np.int64)
    assert paths.point(short, np.array([5.0]))[0] == pytest.approx([0.3, 0.0])
    assert paths.place(short, np.array([[2.0, 0.0]]), np.array([0.3]))[0][0] == pytest.approx(0.3)
    assert SPACING < 0.3
