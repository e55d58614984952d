"""Tracking of the commands in a trial: mean absolute errors (paper eq. 9), and the fraction of the path covered."""

from typing import NamedTuple

import numpy as np

from iowbc.arrays import Array, Mask
from iowbc.control.command import HEIGHT, PITCH, YAW_RATE
from iowbc.recipe.task.commands import Commands
from iowbc.robot.rotations import turned, wrapped
from iowbc.task.record.signals import Trace

ERRORS = ("E_alpha", "E_h", "E_v", "E_psi")
"""The paper's four errors in the order of its columns: torso pitch [rad], height [m], velocity [m/s], heading [rad]."""
SHORTEST_WAY = 0.1
"""Minimum commanded distance for a transport metric [m]."""


class Deviations(NamedTuple):
    """Deviations of a trial from a command, in the order of `ERRORS`, one row per control step, each of shape (T,)."""

    pitch: Array
    height: Array
    velocity: Array
    """Planar |v_sys - v_coll|."""
    heading: Array

    def means(self, suffix: str = "", part: Mask | slice = slice(None)) -> dict[str, float]:
        """Mean errors over a part of the trial, named by `ERRORS` and a suffix; NaN if the part is empty."""
        parts = {f"{name}{suffix}": values[part] for name, values in zip(ERRORS, self, strict=True)}
        return {name: float(np.mean(values)) if len(values) else np.nan for name, values in parts.items()}


def start_heading(trace: Trace) -> float:
    """Heading reference before the first step [rad]; the first row of the trace is after that step."""
    return float(trace.heading_reference[0] - trace.commanded_velocity[0, YAW_RATE] * trace.dt)


def deviations_from_given(trace: Trace, given: Array, window: int) -> Deviations:
    """Deviations from the original commands (T, 11); `window`: control steps of a gait period, to average v_sys."""
    heading = start_heading(trace) + trace.dt * np.cumsum(given[:, YAW_RATE])
    return Deviations(
        pitch=np.abs(trace.torso_pitch - given[:, PITCH]),
        height=np.abs(trace.pelvis_height - given[:, HEIGHT]),
        velocity=velocity_deviation(trace.system_velocity, given, window),
        heading=np.abs(wrapped(trace.heading - heading)),
    )


def deviations_from_clamped(trace: Trace, window: int) -> Deviations:
    """Deviations from the commands after feasibility clamping and rate limits."""
    return Deviations(
        pitch=np.abs(trace.torso_pitch - trace.torso_pitch_command),
        height=np.abs(trace.pelvis_height - trace.height_command),
        velocity=velocity_deviation(trace.system_velocity, trace.commanded_velocity, window),
        heading=np.abs(wrapped(trace.heading - trace.heading_reference)),
    )


def deviations_standing_still(given: Array, commands: Commands, dt: float) -> Deviations:
    """Deviations of a robot that stands still in the nominal posture, from the commands (T, 11) alone."""
    return Deviations(
        pitch=np.abs(given[:, PITCH] - commands.nominal_pitch),
        height=np.abs(given[:, HEIGHT] - commands.nominal_height),
        velocity=np.hypot(given[:, 0], given[:, 1]),
        heading=np.abs(wrapped(dt * np.cumsum(given[:, YAW_RATE]))),
    )


def velocity_deviation(system_velocity: Array, commanded: Array, window: int) -> Array:
    """Planar |v_sys - v_coll| with v_sys (T, 3) averaged over `window` steps, (T,) [m/s]."""
    averaged = moving_average(system_velocity[:, :2], window)
    return np.asarray(np.linalg.norm(averaged - commanded[:, :2], axis=1))


def moving_average(values: Array, window: int) -> Array:
    """Mean over a centred window (>= 1 step) along the first axis, shortened at both ends, shape as `values`."""
    before, after = (window - 1) // 2, window // 2
    summed = np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])
    steps = np.arange(len(values))
    first, last = np.maximum(steps - before, 0), np.minimum(steps + after + 1, len(values))
    counts = (last - first).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((summed[last] - summed[first]) / counts)


def error_norm(errors: Array) -> Array:
    """Euclidean norm of the paper's four errors in SI units, (..., 4) to (...): the simplest reading of its "norm
    error"."""
    return np.asarray(np.linalg.norm(errors, axis=-1))


def commanded_path(given: Array, heading: float, dt: float) -> tuple[Array, float]:
    """Directions of the commanded motion in the world frame, (T, 2), zero in standing, and path length [m].

    given: commands (T, 11); heading: of the robot at the start [rad].
    """
    yaw = heading + dt * np.cumsum(given[:, YAW_RATE])
    velocity, speed = turned(given[:, :2], yaw), np.hypot(given[:, 0], given[:, 1])
    directions = np.divide(velocity, speed[:, None], out=np.zeros_like(velocity), where=speed[:, None] > 0)
    return directions, float(speed.sum() * dt)


def covered(position: Array, directions: Array, length: float) -> float:
    """Fraction of a commanded path that a body covers; NaN for a path shorter than `SHORTEST_WAY`.

    position: (T, 2 or more) [m]; directions: (T or more, 2) and length [m] of `commanded_path`. Covered distance is the
    body's motion along the direction commanded at the time; swaying cancels and sideways motion does not count.
    """
    if length < SHORTEST_WAY:
        return np.nan
    steps = np.diff(position[:, :2], axis=0)
    return float(np.sum(steps * directions[1 : len(position)]) / length)


def beside(robot: Array, heading: Array, body: Array, moving: Mask) -> float:
    """Largest lateral distance of a body from the robot while stepping is commanded [m]; NaN if it never is.

    robot, body: (T, 2 or more) [m]; heading: (T,) [rad]; moving: (T,).
    """
    if not moving.any():
        return np.nan
    away = body[:, :2] - robot[:, :2]
    aside = np.cos(heading) * away[:, 1] - np.sin(heading) * away[:, 0]
    return float(np.max(np.abs(aside[moving])))
