"""Batched rotations: unit quaternions (w, x, y, z) and matrices, any leading shape; no np.cross, which is slow."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])
"""Places of the components that follow x, y and z in turn, and of those that follow these."""


def cross(a: Array, b: Array) -> Array:
    """a × b, shapes (..., 3)."""
    out: Array = a.take(NEXT, axis=-1) * b.take(LAST, axis=-1)
    out -= a.take(LAST, axis=-1) * b.take(NEXT, axis=-1)
    return out


def rotate(quaternion: Array, vector: Array) -> Array:
    """R(q) v: from the rotated frame into the outer one; shapes (..., 4) and (..., 3)."""
    axis = quaternion[..., 1:]
    t = 2.0 * cross(axis, vector)
    rotated: Array = vector + quaternion[..., :1] * t + cross(axis, t)
    return rotated


def rotate_inverse(quaternion: Array, vector: Array) -> Array:
    """R(q)ᵀ v: from the outer frame into the rotated one; shapes (..., 4) and (..., 3)."""
    axis = quaternion[..., 1:]
    t = 2.0 * cross(axis, vector)
    rotated: Array = vector - quaternion[..., :1] * t + cross(axis, t)
    return rotated


def multiply(a: Array, b: Array) -> Array:
    """Quaternion product a ⊗ b: first rotate by b, then by a; shapes (..., 4)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), dtype=np.result_type(a, b))
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    out[..., 0] = aw * bw - ax * bx - ay * by - az * bz
    out[..., 1] = aw * bx + ax * bw + ay * bz - az * by
    out[..., 2] = aw * by - ax * bz + ay * bw + az * bx
    out[..., 3] = aw * bz + ax * by - ay * bx + az * bw
    return out


def conjugate(quaternion: Array) -> Array:
    """The inverse rotation of a unit quaternion; shape (..., 4)."""
    out = -quaternion
    out[..., 0] = quaternion[..., 0]
    return out


def normalized(quaternion: Array) -> Array:
    """The quaternion scaled to unit length; shape (..., 4)."""
    unit: Array = quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)
    return unit


def from_axis_angle(axis: Array, angle: Array) -> Array:
    """Rotation by `angle` (...) [rad] about the unit vector `axis` (..., 3)."""
    half = 0.5 * np.asarray(angle)
    out = np.empty((*np.broadcast_shapes(axis.shape[:-1], half.shape), 4), dtype=np.result_type(axis, half))
    out[..., 0] = np.cos(half)
    out[..., 1:] = np.sin(half)[..., None] * axis
    return out


def from_rotation_vector(vector: Array) -> Array:
    """Exponential map: rotation by |v| [rad] about v; shape (..., 3)."""
    half = 0.5 * np.linalg.norm(vector, axis=-1, keepdims=True)
    scale = 0.5 * np.sinc(half / np.pi)
    return np.concatenate([np.cos(half), scale * vector], axis=-1)


def to_rotation_vector(quaternion: Array) -> Array:
    """Logarithm of a unit quaternion: axis times angle, angle within [0, π]; shape (..., 3) [rad]."""
    positive = np.where(quaternion[..., :1] < 0.0, -quaternion, quaternion)
    sine = np.linalg.norm(positive[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, positive[..., :1])
    tiny = sine < 1e-12
    vector: Array = positive[..., 1:] * np.where(tiny, 2.0, angle / np.where(tiny, 1.0, sine))
    return vector


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


def yaw_of(quaternion: Array) -> Array:
    """Heading: angle of the frame's x axis about the vertical, of Rz Ry Rx; shape (...) [rad]."""
    w, x, y, z = quaternion[..., 0], quaternion[..., 1], quaternion[..., 2], quaternion[..., 3]
    yaw: Array = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return yaw


def lean_of(rotation: Array) -> Array:
    """Lean against gravity, positive forward: atan2(-R₂₀, R₂₂) of matrices (..., 3, 3), shape (...) [rad]."""
    lean: Array = np.arctan2(-rotation[..., 2, 0], rotation[..., 2, 2])
    return lean


def roll_of(rotation: Array) -> Array:
    """Roll of Rz Ry Rx, positive to the right: atan2(R₂₁, R₂₂) of matrices (..., 3, 3), shape (...) [rad]."""
    roll: Array = np.arctan2(rotation[..., 2, 1], rotation[..., 2, 2])
    return roll


def heading(quaternion: Array) -> Array:
    """The rotation about the vertical by the frame's yaw: the heading frame; shape (..., 4)."""
    half = 0.5 * yaw_of(quaternion)
    out = np.zeros((*half.shape, 4), dtype=half.dtype)
    out[..., 0], out[..., 3] = np.cos(half), np.sin(half)
    return out


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
    rotation: Array = np.eye(3) + sine * skew + versine * (skew @ skew)
    return rotation


def wrap(angle: Array) -> Array:
    """Angle brought into (-π, π]; any shape [rad]."""
    wrapped: Array = np.pi - np.mod(np.pi - angle, 2.0 * np.pi)
    return wrapped
