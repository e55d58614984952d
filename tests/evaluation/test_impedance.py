"""Mechanical impedance, of masses, springs and dampers whose motion is known."""

import numpy as np
import pytest

from iowbc.arrays import Array
from iowbc.evaluation.trials.impedance import apparent, impedance, impedance_metrics

DT = 0.02
STIFFNESS, DAMPING, MASS = 400.0, 60.0, 12.0


def pulled(frequency: float, seconds: float = 12.0) -> tuple[Array, Array]:
    """A pull of 10 N, and the steady motion of a mass on spring and damper at the end of each control period."""
    angular = 2 * np.pi * frequency
    middle = DT * (np.arange(round(seconds / DT)) + 0.5)
    answer = 10.0 / (STIFFNESS - MASS * angular**2 + 1j * angular * DAMPING)
    return 10.0 * np.cos(angular * middle), np.real(answer * np.exp(1j * angular * (middle + 0.5 * DT)))


@pytest.mark.parametrize("frequency", [0.2, 0.5, 1.0, 2.0])
def test_the_impedance_of_a_mass_on_spring_and_damper_is_recovered(frequency: float) -> None:
    angular = 2 * np.pi * frequency
    expected = DAMPING + 1j * (MASS * angular - STIFFNESS / angular)
    assert impedance(*pulled(frequency), frequency, DT) == pytest.approx(expected, rel=1e-3)


def test_drift_and_noise_of_a_balancing_robot_hardly_matter() -> None:
    force, position = pulled(0.5)
    time, noise = DT * np.arange(len(force)), np.random.default_rng(0).normal(0.0, 0.002, len(force))
    clean = impedance(force, position, 0.5, DT)
    assert impedance(force, position + 0.03 * time - 0.002 * time**2 + noise, 0.5, DT) == pytest.approx(clean, rel=0.02)


def test_phase_tells_spring_damper_and_mass_apart() -> None:
    time = DT * (np.arange(600) + 0.5)
    angle = np.pi * time
    late = np.pi * (time + 0.5 * DT)
    for position, phase in ((np.cos(late), -np.pi / 2), (np.sin(late), 0.0), (-np.cos(late), np.pi / 2)):
        assert impedance_metrics(np.cos(angle), position, 0.5, DT)["impedance_phase"] == pytest.approx(phase, abs=1e-3)


def test_stiffness_damping_and_mass_follow_from_several_frequencies() -> None:
    frequencies = np.array([0.2, 0.5, 1.0, 2.0])
    values = np.array([impedance(*pulled(one), one, DT) for one in frequencies])
    found = apparent(frequencies, values)
    assert (found.stiffness, found.damping, found.mass) == pytest.approx((STIFFNESS, DAMPING, MASS), rel=1e-3)
    assert np.isnan([apparent(frequencies[:1], values[:1]).mass, apparent(frequencies[:1], values[:1]).stiffness]).all()
