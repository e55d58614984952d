"""r_smooth: whole-body smoothness."""

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.task.rewards.kernel import squared_norm

LEAST_LIMIT = 1.0
"""Torque limit that a motor at its no-load speed counts as having [N·m]; there it has none."""


def joint_acceleration(acceleration: Array) -> Array:
    """Σ q̈², (n,) [rad²/s⁴]; joints (n, 29)."""
    return squared_norm(acceleration)


def action_rate(action: Array, previous: Array) -> Array:
    """‖a_t − a_{t−1}‖², (n,); actions (n, 15)."""
    return squared_norm(action - previous)


def action_curvature(action: Array, previous: Array, before: Array) -> Array:
    """‖a_t − 2a_{t−1} + a_{t−2}‖², (n,); actions (n, 15)."""
    return squared_norm(action - 2.0 * previous + before)


def effort(torque: Array, limit: Array, comfortable: float) -> Array:
    """Σ max(|τ|/τ_max − comfortable, 0)², (n,); joints (n, 29) [N·m]."""
    return squared_norm(np.maximum(np.abs(torque) / np.maximum(limit, LEAST_LIMIT) - comfortable, 0.0))


def power(torque: Array, velocity: Array) -> Array:
    """Σ |τ·q̇|, (n,) [W]; joints (n, 29). Braking costs as much as driving: the motors do not recover it."""
    return np.vecdot(np.abs(torque), np.abs(velocity))


def base_rates(angular_velocity: Array) -> Array:
    """ω_roll² + ω_pitch² of the base, (n,) [rad²/s²]; base frame (n, 3)."""
    return squared_norm(angular_velocity[:, :2])


def vertical_velocity(base_velocity: Array, commanded: Array) -> Array:
    """(ż − ż_command)² of the base, (n,) [m²/s²]; velocity (n, 3), rate of the commanded height (n,) [m/s]."""
    return np.square(base_velocity[:, 2] - commanded)


def saturation(saturated: Mask) -> Array:
    """Fraction of joints at their torque limit, (n,); joints (n, k)."""
    return saturated.sum(axis=1) / saturated.shape[1]
