"""Mechanical impedance of the robot to a sinusoidal pull on the object that it holds."""

from typing import NamedTuple

import numpy as np

from iowbc.arrays import Array
from iowbc.robot.rotations import turned
from iowbc.task.episodes import PlannedPull
from iowbc.task.record.signals import Trace


class Apparent(NamedTuple):
    """Equivalent mass-spring-damper, m ẍ + c ẋ + k x = F, of the robot with its object."""

    stiffness: float
    """k [N/m]."""
    damping: float
    """c [N·s/m]."""
    mass: float
    """m [kg]."""


def impedance(force: Array, position: Array, frequency: float, dt: float) -> complex:
    """Z = F / v at a frequency [Hz], complex [N·s/m]: i·ω·m of a mass, c of a damper, k / (i·ω) of a spring.

    force: along the pull, held over each control period at its value in the middle; position: at the end of the
    period; (T,) [N, m]. The amplitudes are a least-squares fit of sine and cosine together with a quadratic drift, for
    the robot's own motion. NaN without any motion.
    """
    time = dt * np.arange(len(force))
    angle = 2.0 * np.pi * frequency * time
    scaled = time / time[-1]
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones_like(time), scaled, np.square(scaled)], axis=1)
    fitted = np.linalg.lstsq(basis, np.stack([force, position], axis=1), rcond=None)[0]
    pulled, moved = (fitted[0] - 1j * fitted[1]) * np.array([1.0, np.exp(-1j * np.pi * frequency * dt)])
    return complex(pulled / (2j * np.pi * frequency * moved)) if moved else complex(np.nan, np.nan)


def impedance_metrics(trace: Trace, pull: PlannedPull | None) -> dict[str, float]:
    """Impedance of the object's centre to a pull after its first period: `impedance_real`, `_imag`, `_magnitude`
    [N·s/m] and `_phase` [rad], from -π/2 (spring) over 0 (damper) to π/2 (mass). NaN without a pull, or if the trial
    ended before its end."""
    value = complex(np.nan, np.nan)
    if pull is not None:
        period = 1.0 / pull.frequency
        first, last = (round((pull.begin + time) / trace.dt) for time in (period, pull.duration))
        if last - first >= round(period / trace.dt) and len(trace) >= last:
            (along,) = turned(np.array([pull.force]), trace.heading_reference[[first]])
            along /= np.linalg.norm(along)
            force, position = trace.external_force[first:last, :2], trace.object_position[first:last, :2]
            value = impedance(force @ along, position @ along, pull.frequency, trace.dt)
    return {
        "impedance_real": value.real,
        "impedance_imag": value.imag,
        "impedance_magnitude": abs(value),
        "impedance_phase": float(np.angle(value)),
    }


def apparent(frequency: Array, value: Array) -> Apparent:
    """Mass, spring and damper fitted to impedances `value` (k,), complex, at frequencies (k,) [Hz], by least squares in
    Z = c + i (ω m - k / ω). With fewer than two frequencies, mass and stiffness are undetermined: NaN."""
    angular = 2.0 * np.pi * frequency
    if len(np.unique(frequency)) < 2:
        return Apparent(np.nan, float(np.mean(value.real)), np.nan)
    mass, stiffness = np.linalg.lstsq(np.stack([angular, -1.0 / angular], axis=1), value.imag, rcond=None)[0]
    return Apparent(float(stiffness), float(np.mean(value.real)), float(mass))
