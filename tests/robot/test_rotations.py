"""Batched rotations: group laws and conventions."""

import numpy as np
import pytest

from iowbc.robot import rotations

A = rotations.normalized(np.random.default_rng(0).normal(size=(50, 4)))
V, W = np.random.default_rng(1).normal(size=(2, 50, 3))


def test_cross_product_is_numpys() -> None:
    np.testing.assert_allclose(rotations.cross(V, W), np.cross(V, W), atol=1e-14)


def test_the_inverse_undoes_a_rotation() -> None:
    np.testing.assert_allclose(rotations.rotate_inverse(A, rotations.rotate(A, V)), V, atol=1e-12)


def test_matrix_and_quaternion_rotate_alike() -> None:
    turned = np.einsum("nij,nj->ni", rotations.matrix(A), V)
    np.testing.assert_allclose(turned, rotations.rotate(A, V), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(rotations.matrix(A)), 1.0, atol=1e-12)


def test_euler_angles_come_back() -> None:
    roll, pitch, yaw = np.random.default_rng(2).uniform(-1.2, 1.2, (3, 50))
    quaternion = rotations.from_euler(roll, pitch, yaw)
    rotation = rotations.matrix(quaternion)
    np.testing.assert_allclose(np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0]), yaw, atol=1e-12)
    np.testing.assert_allclose(rotations.side_tilt_of(rotation), np.arcsin(np.sin(roll) * np.cos(pitch)), atol=1e-12)
    np.testing.assert_allclose(rotations.lean_of(rotation), np.arctan2(np.tan(pitch), np.cos(roll)), atol=1e-12)


def test_a_forward_lean_is_positive() -> None:
    lean = rotations.from_euler(np.zeros(1), np.array([0.4]), np.array([2.0]))
    assert rotations.lean_of(rotations.matrix(lean))[0] == pytest.approx(0.4)
    np.testing.assert_allclose(
        rotations.axis_matrix(np.array([0.0, 1.0, 0.0]), np.array([0.4]))[0] @ [0, 0, 1.0],
        [np.sin(0.4), 0, np.cos(0.4)],
    )
