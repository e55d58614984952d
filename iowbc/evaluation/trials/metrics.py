"""From the signals of trials to one row of figures a trial (paper eq. 9)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ERRORS = ("E_alpha", "E_h", "E_v", "E_psi")
"""The paper's four errors in the order of its columns: torso pitch [rad], height [m], velocity [m/s], heading [rad]."""


@dataclass(frozen=True)
class Trace:
    """The signals of one trial, one row a control step, up to its end or its fall."""

    dt: float
    """Control period [s]."""
    system_velocity: Array
    """Common centre of mass of robot and object, heading frame, shape (T, 3) [m/s]."""
    commanded_velocity: Array
    """v_x, v_y [m/s], yaw rate [rad/s], heading frame, shape (T, 3)."""
    heading: Array
    """Yaw of the base, shape (T,) [rad]."""
    heading_reference: Array
    """Integrated commanded yaw rate, shape (T,) [rad]."""
    torso_pitch: Array
    """Shape (T,) [rad]."""
    torso_pitch_command: Array
    """Shape (T,) [rad]."""
    pelvis_height: Array
    """Shape (T,) [m]."""
    height_command: Array
    """Shape (T,) [m]."""
    saturation: Array
    """Share of the joints at their torque limit, shape (T,)."""
    slipped: Array
    """1 while a hand does not hold the object, or in a push does not touch it, shape (T,)."""
    partner_force: Array
    """Partner's force on the object, shape (T, 3) [N]."""
    grip_force: Array
    """Force of the object on each hand, left then right, world, shape (T, 6) [N]."""
    power: Array
    """Sum over the joints of |torque x speed|, shape (T,) [W]."""
    base_position: Array
    """Shape (T, 3), world [m]."""


def moving_average(values: Array, window: int) -> Array:
    """Mean over a centred window (>= 1 step) along the first axis, shortened at both ends, shape as `values`."""
    before, after = (window - 1) // 2, window // 2
    summed = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    steps = np.arange(len(values))
    first, last = np.maximum(steps - before, 0), np.minimum(steps + after + 1, len(values))
    counts = (last - first).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((summed[last] - summed[first]) / counts, np.float64)


def wrapped(angle: Array) -> Array:
    """The same angle in [-pi, pi) [rad]."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi, np.float64)


def velocity_error(system_velocity: Array, commanded_velocity: Array, window: int) -> float:
    """E_v: mean planar |v_sys - v_coll| with v_sys averaged over `window` steps, one gait period [m/s]."""
    averaged = moving_average(system_velocity[:, :2], window)
    return float(np.mean(np.linalg.norm(averaged - commanded_velocity[:, :2], axis=1)))


def trial_metrics(trace: Trace, gait_steps: int) -> dict[str, float]:
    """The paper's errors, means over the trial, and what the trial cost.

    gait_steps: control steps of one gait period, over which v_sys is averaged; `E_v_raw` is without averaging.
    """
    steps = len(trace.heading)
    if steps == 0:
        raise ValueError("a trial without a single step has no metrics")
    travelled = np.diff(trace.base_position[:, :2], axis=0, prepend=trace.base_position[:1, :2])
    return {
        "E_alpha": float(np.mean(np.abs(trace.torso_pitch - trace.torso_pitch_command))),
        "E_h": float(np.mean(np.abs(trace.pelvis_height - trace.height_command))),
        "E_v": velocity_error(trace.system_velocity, trace.commanded_velocity, gait_steps),
        "E_psi": float(np.mean(np.abs(wrapped(trace.heading - trace.heading_reference)))),
        "E_v_raw": velocity_error(trace.system_velocity, trace.commanded_velocity, 1),
        "saturation": float(np.mean(trace.saturation)),
        "saturation_peak": float(np.max(trace.saturation)),
        "slip_share": float(np.mean(trace.slipped > 0)),
        "partner_force_peak": float(np.max(np.linalg.norm(trace.partner_force, axis=1))),
        "grip_force_peak": float(np.max(np.linalg.norm(trace.grip_force.reshape(steps, 2, 3), axis=2))),
        "energy": float(np.sum(trace.power) * trace.dt),
        "distance": float(np.sum(np.linalg.norm(travelled, axis=1))),
    }


def error_norm(errors: Array) -> Array:
    """Euclidean norm of the paper's four errors in SI units, shape (..., 4) to (...).

    The paper's "norm error" is not defined there; this is the plainest reading.
    """
    return np.asarray(np.linalg.norm(errors, axis=-1), np.float64)
