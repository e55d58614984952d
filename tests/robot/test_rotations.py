"""Batched rotations: group laws and conventions."""

import numpy as np
import pytest

from iowbc.robot import rotations

RANDOM = np.random.default_rng(0)
A, B = (rotations.normalized(RANDOM.normal(size=(50, 4))) for _ in range(2))
V, W = RANDOM.normal(size=(2, 50, 3))


def test_cross_product_is_numpys() -> None:
    np.testing.assert_allclose(rotations.cross(V, W), np.cross(V, W), atol=1e-14)


def test_a_product_rotates_by_the_right_factor_first() -> None:
    both = rotations.rotate(rotations.multiply(A, B), V)
    np.testing.assert_allclose(both, rotations.rotate(A, rotations.rotate(B, V)), atol=1e-12)


def test_the_inverse_undoes_a_rotation() -> None:
    np.testing.assert_allclose(rotations.rotate_inverse(A, rotations.rotate(A, V)), V, atol=1e-12)
    np.testing.assert_allclose(rotations.rotate(rotations.conjugate(A), V), rotations.rotate_inverse(A, V), atol=1e-12)


def test_matrix_and_quaternion_rotate_alike() -> None:
    turned = np.einsum("nij,nj->ni", rotations.matrix(A), V)
    np.testing.assert_allclose(turned, rotations.rotate(A, V), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(rotations.matrix(A)), 1.0, atol=1e-12)


def test_rotation_vectors_come_back() -> None:
    vector = 0.9 * np.pi * V / np.linalg.norm(V, axis=1, keepdims=True)
    back = rotations.to_rotation_vector(rotations.from_rotation_vector(vector))
    np.testing.assert_allclose(back, vector, atol=1e-9)
    assert np.isfinite(rotations.to_rotation_vector(rotations.from_rotation_vector(np.zeros((1, 3))))).all()


def test_euler_angles_come_back() -> None:
    roll, pitch, yaw = RANDOM.uniform(-1.2, 1.2, (3, 50))
    quaternion = rotations.from_euler(roll, pitch, yaw)
    np.testing.assert_allclose(rotations.yaw_of(quaternion), yaw, atol=1e-12)
    rotation = rotations.matrix(quaternion)
    np.testing.assert_allclose(rotations.roll_of(rotation), roll, atol=1e-12)
    np.testing.assert_allclose(rotations.lean_of(rotation), np.arctan2(np.tan(pitch), np.cos(roll)), atol=1e-12)


def test_the_heading_keeps_the_yaw_alone() -> None:
    quaternion = rotations.from_euler(np.array([0.3]), np.array([0.4]), np.array([1.0]))
    frame = rotations.heading(quaternion)
    np.testing.assert_allclose(rotations.rotate(frame, np.array([[0.0, 0.0, 1.0]])), [[0.0, 0.0, 1.0]], atol=1e-12)
    assert rotations.yaw_of(frame)[0] == pytest.approx(1.0)


def test_a_forward_lean_is_positive() -> None:
    lean = rotations.from_euler(np.zeros(1), np.array([0.4]), np.array([2.0]))
    assert rotations.lean_of(rotations.matrix(lean))[0] == pytest.approx(0.4)
    np.testing.assert_allclose(
        rotations.axis_matrix(np.array([0.0, 1.0, 0.0]), np.array([0.4]))[0] @ [0, 0, 1.0],
        [np.sin(0.4), 0, np.cos(0.4)],
    )


def test_angles_wrap_to_half_a_turn() -> None:
    np.testing.assert_allclose(rotations.wrap(np.array([3.5, -3.5, 0.1])), [3.5 - 2 * np.pi, 2 * np.pi - 3.5, 0.1])
