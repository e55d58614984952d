"""Chains of hinges against products of rotation matrices."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from iowbc.control.chain import Chain, turn
from iowbc.robot import rotations

LENGTH, ROWS = 4, 5


@pytest.fixture
def random() -> np.random.Generator:
    return np.random.default_rng(0)


def body(axis: Any, random: np.random.Generator) -> Any:
    quaternion = rotations.normalized(random.normal(size=4))
    return SimpleNamespace(
        name="link", position=random.normal(size=3), quaternion=quaternion, hinge=SimpleNamespace(axis=np.array(axis))
    )


def unit(random: np.random.Generator) -> Any:
    vector = random.normal(size=3)
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
def test_points_directions_and_jacobian_are_those_of_the_matrices(axes: list[Any], random: np.random.Generator) -> None:
    pairs = [(unit(random), unit(random)) if pair == "skew" else pair for pair in axes]
    chains = [[body(pair[side], random) for pair in pairs] for side in range(2)]
    angle, grip, direction = random.normal(size=(LENGTH, 2, ROWS)), random.normal(size=3), unit(random)
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
def test_a_turn_is_a_rotation_about_its_axis(axis: int, random: np.random.Generator) -> None:
    vectors, angle = random.normal(size=(3, 2, 1, ROWS)), random.normal(size=(1, ROWS))
    expected = np.einsum("nij,jksn->iksn", rotations.axis_matrix(np.eye(3)[axis], angle[0]), vectors)
    turn(vectors, axis, angle)
    assert vectors == pytest.approx(expected)


def test_a_body_without_a_hinge_is_fixed_to_the_one_before(random: np.random.Generator) -> None:
    chain = [body([0, 0, 1], random), body([1, 0, 0], random), body([0, 1, 0], random)]
    chain[1].hinge = None
    angle, point = random.normal(size=(2, 1, 1)), random.normal(size=3)
    carried = point.reshape(3, 1, 1, 1).copy()
    Chain([chain]).carry(angle, carried)
    chain[1].hinge = SimpleNamespace(axis=np.array([1, 0, 0]))
    rotation, position, _, _ = by_matrices(chain, [angle[0, 0, 0], 0.0, angle[1, 0, 0]])
    assert carried.ravel() == pytest.approx(position + rotation @ point)


def test_a_chain_ends_at_a_hinge(random: np.random.Generator) -> None:
    stiff = body([1, 0, 0], random)
    stiff.hinge = None
    with pytest.raises(ValueError, match="'link' ends a joint chain but has no hinge"):
        Chain([[stiff]])


def test_the_example_of_the_docstring(random: np.random.Generator) -> None:
    upper, lower = body([0, 0, 1], random), body([0, 1, 0], random)
    upper.quaternion = lower.quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    upper.position, lower.position = np.zeros(3), np.array([0.2, 0.0, 0.0])
    vectors = np.zeros((3, 3, 1, 1))
    vectors[:, 2, 0, 0] = (0.3, 0.0, 0.0)
    Chain([[upper, lower]]).carry(np.full((2, 1, 1), np.pi / 2), vectors, columns=2)
    assert vectors[:, 2, 0, 0] == pytest.approx([0.0, 0.2, -0.3])
    assert vectors[:, 0, 0, 0] == pytest.approx([-0.2, 0.0, 0.0])
    assert vectors[:, 1, 0, 0] == pytest.approx([0.0, -0.3, 0.0])
