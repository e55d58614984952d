"""Batched rotations: unit quaternions (w, x, y, z) and matrices, any leading shape; no np.cross, which is slow."""

import numpy as np

from iowbc.arrays import Array

TINY = 1e-9
"""Keeps a division by a length, force or share from dividing by zero."""
NEXT = np.array([1, 2, 0])
"""Places of the components that follow x, y and z in turn."""


def cross(a: Array, b: Array) -> Array:
    """a × b, shapes (..., 3): computed in the order z, x, y, then reordered."""
    before = a * b.take(NEXT, axis=-1)
    before -= a.take(NEXT, axis=-1) * b
    return before.take(NEXT, axis=-1)


def rotate(quaternion: Array, vector: Array) -> Array:
    """R(q) v: from the rotated frame into the outer one; shapes (..., 4) and (..., 3)."""
    axis = quaternion[..., 1:]
    t = 2.0 * cross(axis, vector)
    return vector + quaternion[..., :1] * t + cross(axis, t)


def rotate_inverse(quaternion: Array, vector: Array) -> Array:
    """R(q)ᵀ v: from the outer frame into the rotated one; shapes (..., 4) and (..., 3)."""
    axis = quaternion[..., 1:]
    t = 2.0 * cross(axis, vector)
    return vector - quaternion[..., :1] * t + cross(axis, t)


def wrapped(angle: Array) -> Array:
    """The same angles in [-π, π) [rad], shape as given."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def turned(vectors: Array, angle: Array) -> Array:
    """Vectors (n, 2 or 3) turned about the vertical by angles (n,) [rad]."""
    return turned_by(vectors, np.cos(angle), np.sin(angle))


def turned_by(vectors: Array, cosine: Array, sine: Array) -> Array:
    """The same for angles with these cosines and sines, (n,)."""
    result = vectors.copy()
    result[:, 0] = cosine * vectors[:, 0] - sine * vectors[:, 1]
    result[:, 1] = sine * vectors[:, 0] + cosine * vectors[:, 1]
    return result


def normalized(quaternion: Array) -> Array:
    """The quaternion scaled to unit length; shape (..., 4)."""
    return quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)


def from_euler(roll: Array, pitch: Array, yaw: Array) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), angles of any one shape [rad]."""
    cr, sr = np.cos(0.5 * np.asarray(roll)), np.sin(0.5 * np.asarray(roll))
    cp, sp = np.cos(0.5 * np.asarray(pitch)), np.sin(0.5 * np.asarray(pitch))
    cy, sy = np.cos(0.5 * np.asarray(yaw)), np.sin(0.5 * np.asarray(yaw))
    return np.stack(
        [
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        ],
        axis=-1,
    )


def lean_of(rotation: Array) -> Array:
    """Lean against gravity, positive forward: atan2(-R₂₀, R₂₂) of matrices (..., 3, 3), shape (...) [rad]."""
    return np.arctan2(-rotation[..., 2, 0], rotation[..., 2, 2])


def side_tilt_of(rotation: Array) -> Array:
    """Tilt to a side, positive to the right, at any pitch: asin(R₂₁) of matrices (..., 3, 3), shape (...) [rad]. The
    roll of Rz Ry Rx exceeds it by 1 / cos(pitch), and is undefined at a bow of a right angle."""
    return np.arcsin(rotation[..., 2, 1].clip(-1.0, 1.0))


def matrix(quaternion: Array) -> Array:
    """Rotation matrices of unit quaternions; shape (..., 3, 3)."""
    w, x, y, z = quaternion[..., 0], quaternion[..., 1], quaternion[..., 2], quaternion[..., 3]
    out = np.empty((*quaternion.shape[:-1], 3, 3), dtype=quaternion.dtype)
    out[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    out[..., 0, 1] = 2.0 * (x * y - w * z)
    out[..., 0, 2] = 2.0 * (x * z + w * y)
    out[..., 1, 0] = 2.0 * (x * y + w * z)
    out[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    out[..., 1, 2] = 2.0 * (y * z - w * x)
    out[..., 2, 0] = 2.0 * (x * z - w * y)
    out[..., 2, 1] = 2.0 * (y * z + w * x)
    out[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return out


def axis_matrix(axis: Array, angle: Array) -> Array:
    """Rotation matrices about one fixed unit axis (3,) by angles (...) [rad]; Rodrigues' formula, shape (..., 3, 3)."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, versine = np.sin(angle)[..., None, None], (1.0 - np.cos(angle))[..., None, None]
    return np.eye(3) + sine * skew + versine * (skew @ skew)
