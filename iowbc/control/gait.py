"""The gait clock φ_t: when it runs, and which foot should be on the ground."""

import numpy as np

from iowbc.arrays import Array, Mask, namespace
from iowbc.control.sensors import Measured
from iowbc.recipe.task.joint_references import GaitPrior, Recovery
from iowbc.robot.mirror import in_place

TINY = 1e-6
"""Fraction of a stride within which half a stride counts as complete: float32 rounds a phase by 1e-7."""
phase_mirror = in_place(-1.0, -1.0)
"""Half a stride later: (sin, cos) of the phase change sign, and the zero of standing stays."""


def wants_to_move(command: Array, gait: GaitPrior) -> Mask:
    """True where the commanded velocity requires steps; command (n, 11), result (n,)."""
    xp = namespace(command)
    speed = xp.sqrt(command[:, 0] ** 2 + command[:, 1] ** 2)
    return (speed > gait.moving_speed) | (xp.abs(command[:, 2]) > gait.moving_yaw_rate)


def is_falling(measured: Measured, pelvis_pitch: Array, recovery: Recovery) -> Mask:
    """True where the base is tipping over, (n,), by pitch and roll of the measured gravity, less the reference's, and
    their rates by the gyroscope; `pelvis_pitch` of the reference posture (n,) [rad]."""
    xp, gravity, rate = namespace(pelvis_pitch), measured.projected_gravity, measured.base_angular_velocity
    pitch = gravity[:, 0] - xp.sin(pelvis_pitch) + recovery.horizon * rate[:, 1]
    roll = -gravity[:, 1] + recovery.horizon * rate[:, 0]
    return pitch * pitch + roll * roll > recovery.tilt**2


def foot_phase(phase: Array) -> Array:
    """Phase of the left and the right foot, half a stride apart; (n,) to (n, 2), each in [0, 1)."""
    xp, other = namespace(phase), phase + 0.5
    return xp.concatenate([phase[:, None], (other - xp.floor(other))[:, None]], -1)


def advance(phase: Array, stepping: Mask, moving: Mask, gait: GaitPrior, dt: float) -> tuple[Array, Mask]:
    """One control step of the clock: new phase (n,) and whether it runs (n,). It starts when the command asks for
    motion. When that stops, it runs on until both feet are down, at phase 0 or 0.5, and rests there."""
    xp, advanced = namespace(phase), phase + gait.frequency * dt
    halves = xp.floor(phase * 2.0 + TINY)
    arrived = xp.floor(advanced * 2.0 + TINY) > halves
    rests = ~moving & (~stepping | arrived)
    kept = xp.where(stepping & arrived, (halves + 1.0) * 0.5, phase)
    new = xp.where(rests, kept, advanced) % 1.0
    return new, ~rests


def swing_progress(foot_phase: Array, stance: float) -> Array:
    """Progress of each foot through its swing, 0 on the ground and 1 at touch-down; (n, 2) to (n, 2)."""
    return ((foot_phase - stance) / (1.0 - stance)).clip(0.0, 1.0)


def swing_height(progress: Array, gait: GaitPrior) -> Array:
    """Height of the soles above the ground by the recipe's profile, of their progress in swing, (n, 2) [m]."""
    sine = namespace(progress).sin(np.pi * progress)
    return gait.swing_clearance * (sine if gait.profile == "sine" else sine * sine)


def expected_stance(foot_phase: Array, stepping: Mask, stance: float) -> Mask:
    """Which feet should be on the ground, (n, 2); both while the clock rests."""
    return (foot_phase < stance) | ~stepping[:, None]


def phase_signal(phase: Array, stepping: Mask) -> Array:
    """(sin 2πφ, cos 2πφ), shape (n, 2); zero while the clock rests, so that standing has a value of its own."""
    xp, angle = namespace(phase), 2.0 * np.pi * phase
    return xp.stack([xp.sin(angle), xp.cos(angle)], 1) * stepping[:, None]
