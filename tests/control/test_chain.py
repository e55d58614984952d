"""Chains of hinges against products of rotation matrices."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from iowbc.control.chain import Chain, rotated, rotated_back, turn
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
def test_points_axes_and_jacobian_are_those_of_the_matrices(axes: list[Any], random: np.random.Generator) -> None:
    pairs = [(unit(random), unit(random)) if pair == "skew" else pair for pair in axes]
    chains = [[body(pair[side], random) for pair in pairs] for side in range(2)]
    angle, grip = random.normal(size=(LENGTH, 2, ROWS)), random.normal(size=3)
    frames = Chain(chains).frames(angle)
    end = frames.end(grip[:, None, None])
    columns = frames.jacobian(end)
    for side, chain in enumerate(chains):
        for row in range(ROWS):
            rotation, position, origins, hinges = by_matrices(chain, angle[:, side, row])
            point = position + rotation @ grip
            expected = [np.cross(axis, point - origin) for axis, origin in zip(hinges, origins, strict=True)]
            np.testing.assert_allclose(columns[:, :, side, row].T, expected, atol=1e-12)
            np.testing.assert_allclose(frames.axis[:, :, side, row], hinges, atol=1e-12)
            assert end[:, side, row] == pytest.approx(point)


def test_rotating_back_undoes_a_rotation(random: np.random.Generator) -> None:
    chain = Chain([[body([0, 0, 1], random), body(unit(random), random)]])
    rotation = chain.frames(random.normal(size=(2, 1, ROWS))).rotation[-1]
    vector = random.normal(size=(3, 1, ROWS))
    assert rotated_back(rotation, rotated(rotation, vector)) == pytest.approx(vector)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_base_may_be_turned(axis: int, random: np.random.Generator) -> None:
    chain, angle, base = (
        Chain([[body([0, 0, 1], random)]]),
        random.normal(size=(1, 1, ROWS)),
        random.normal(size=(1, ROWS)),
    )
    level, tilted = (frames.origin[0] for frames in (chain.frames(angle), chain.frames(angle, turn(axis, base))))
    matrices = rotations.axis_matrix(np.eye(3)[axis], base[0])
    assert pytest.approx(np.einsum("nij,jn->ni", matrices, level[:, 0])) == tilted[:, 0].T


def test_a_body_without_a_hinge_is_fixed_to_the_one_before(random: np.random.Generator) -> None:
    chain = [body([0, 0, 1], random), body([1, 0, 0], random), body([0, 1, 0], random)]
    chain[1].hinge = None
    angle, point = random.normal(size=(2, 1, 1)), random.normal(size=3)
    frames = Chain([chain]).frames(angle)
    chain[1].hinge = SimpleNamespace(axis=np.array([1, 0, 0]))
    rotation, position, _, _ = by_matrices(chain, [angle[0, 0, 0], 0.0, angle[1, 0, 0]])
    carried = frames.end(point[:, None, None])
    assert carried.ravel() == pytest.approx(position + rotation @ point)


def test_a_chain_ends_at_a_hinge(random: np.random.Generator) -> None:
    stiff = body([1, 0, 0], random)
    stiff.hinge = None
    with pytest.raises(ValueError, match="'link' ends a joint chain but has no hinge"):
        Chain([[stiff]])


def test_a_forearm_that_hangs_from_an_elbow_is_where_it_is_by_hand(random: np.random.Generator) -> None:
    """With both hinges at a quarter turn, the end of a forearm of 0.3 m that turns about y lies below the elbow, which
    an upper arm of 0.2 m that turns about z puts to the left of the shoulder."""
    upper, lower = body([0, 0, 1], random), body([0, 1, 0], random)
    upper.quaternion = lower.quaternion = np.array([1.0, 0.0, 0.0, 0.0])
    upper.position, lower.position = np.zeros(3), np.array([0.2, 0.0, 0.0])
    frames = Chain([[upper, lower]]).frames(np.full((2, 1, 1), np.pi / 2))
    end = frames.end(np.array([0.3, 0.0, 0.0])[:, None, None])
    assert end[:, 0, 0] == pytest.approx([0.0, 0.2, -0.3])
    assert frames.jacobian(end)[:, 0, 0, 0] == pytest.approx([-0.2, 0.0, 0.0])
    assert frames.jacobian(end)[:, 1, 0, 0] == pytest.approx([0.0, -0.3, 0.0])
