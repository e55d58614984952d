"""Chains of hinges against products of rotation matrices."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from iowbc.control.chain import Chain, turn
from iowbc.robot import rotations

RANDOM = np.random.default_rng(0)
LENGTH, ROWS = 4, 5


def body(axis: Any) -> Any:
    quaternion = rotations.normalized(RANDOM.normal(size=4))
    return SimpleNamespace(
        name="link", position=RANDOM.normal(size=3), quaternion=quaternion, hinge=SimpleNamespace(axis=np.array(axis))
    )


def unit() -> Any:
    vector = RANDOM.normal(size=3)
    return vector / np.linalg.norm(vector)


def by_matrices(chain: list[Any], angle: Any) -> tuple[Any, Any, list[Any], list[Any]]:
    """Rotation and position of the last body, origins and axes of the hinges, for one row of angles."""
    rotation, position = np.eye(3), np.zeros(3)
    origins, axes = [], []
    for one, value in zip(chain, angle, strict=True):
        position = position + rotation @ one.position
        rotation = rotation @ rotations.matrix(one.quaternion)
        origins.append(position)
        axes.append(rotation @ one.hinge.axis)
        rotation = rotation @ rotations.axis_matrix(one.hinge.axis, value)
    return rotation, position, origins, axes


@pytest.mark.parametrize(
    "axes",
    [
        [([1, 0, 0], [1, 0, 0]), ([0, 1, 0], [0, 1, 0]), ([0, 0, 1], [0, 0, 1]), ([0, 1, 0], [0, 1, 0])],
        [([-1, 0, 0], [1, 0, 0]), ([0, 1, 0], [0, -1, 0]), ([0, 0, -1], [0, 0, -1]), ([1, 0, 0], [-1, 0, 0])],
        [([1, 0, 0], [0, 1, 0]), ([0, 0, 1], [0, 0, 1]), "skew", "skew"],
    ],
    ids=["coordinate axes", "reversed axes", "axes of any direction"],
)
def test_points_directions_and_jacobian_are_those_of_the_matrices(axes: list[Any]) -> None:
    pairs = [(unit(), unit()) if pair == "skew" else pair for pair in axes]
    chains = [[body(pair[side]) for pair in pairs] for side in range(2)]
    angle, grip, direction = RANDOM.normal(size=(LENGTH, 2, ROWS)), RANDOM.normal(size=3), unit()
    with_jacobian = np.empty((3, LENGTH + 1, 2, ROWS))
    with_jacobian[:, -1] = grip[:, None, None]
    Chain(chains).carry(angle, with_jacobian, LENGTH)
    carried = np.empty((3, 2, 2, ROWS))
    carried[:, 0], carried[:, 1] = direction[:, None, None], grip[:, None, None]
    Chain(chains).carry(angle, carried)
    for side, chain in enumerate(chains):
        for row in range(ROWS):
            rotation, position, origins, hinges = by_matrices(chain, angle[:, side, row])
            point = position + rotation @ grip
            jacobian = [np.cross(axis, point - origin) for axis, origin in zip(hinges, origins, strict=True)]
            np.testing.assert_allclose(with_jacobian[:, :-1, side, row].T, jacobian, atol=1e-12)
            assert with_jacobian[:, -1, side, row] == pytest.approx(point)
            assert carried[:, 0, side, row] == pytest.approx(rotation @ direction)
            assert carried[:, 1, side, row] == pytest.approx(point)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_turn_is_a_rotation_about_its_axis(axis: int) -> None:
    vectors, angle = RANDOM.normal(size=(3, 2, 1, ROWS)), RANDOM.normal(size=(1, ROWS))
    expected = np.einsum("nij,jksn->iksn", rotations.axis_matrix(np.eye(3)[axis], angle[0]), vectors)
    turn(vectors, axis, angle)
    assert vectors == pytest.approx(expected)


def test_a_body_without_a_hinge_does_not_belong_on_a_chain() -> None:
    stiff = body([1, 0, 0])
    stiff.hinge = None
    with pytest.raises(ValueError, match="'link' lies on a joint chain but has no hinge"):
        Chain([[stiff]])
