"""Mechanical impedance, of masses, springs and dampers whose motion is known."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_trials import DT, trace

from iowbc.arrays import Array
from iowbc.evaluation.trials.interaction import apparent, impedance, impedance_metrics
from iowbc.task.episodes import PlannedPull

STIFFNESS, DAMPING, MASS = 400.0, 60.0, 12.0


def pulled(
    frequency: float,
    seconds: float = 12.0,
    stiffness: float = STIFFNESS,
    damping: float = DAMPING,
    mass: float = MASS,
) -> tuple[Array, Array]:
    """A pull of 10 N, and the steady motion of a mass on spring and damper at the end of each control period."""
    angular = 2 * np.pi * frequency
    middle = DT * (np.arange(round(seconds / DT)) + 0.5)
    answer = 10.0 / (stiffness - mass * angular**2 + 1j * angular * damping)
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


def test_a_pull_is_measured_in_its_own_direction_while_it_lasts_without_its_first_period() -> None:
    force, position = pulled(0.5, seconds=6.0)  # three periods from 1 s on, to the left of a robot that heads along y
    empty = trace(500)
    forces, positions = np.zeros((500, 3)), np.tile([0.4, 0.0, 0.8], (500, 1))
    forces[50:350, 0], positions[50:350, 0] = -force, -position
    positions[50:150] += 1.0
    pull = PlannedPull(1.0, 6.0, 0.5, (0.0, 10.0))
    signals = replace(
        empty, external_force=forces, object_position=positions, heading_reference=np.full(500, np.pi / 2)
    )
    metrics = impedance_metrics(signals, pull)
    value = impedance(force, position, 0.5, DT)
    assert metrics["impedance_real"] == pytest.approx(value.real)
    assert metrics["impedance_imag"] == pytest.approx(value.imag)
    assert np.isnan([*impedance_metrics(signals, None).values()]).all()
    assert np.isnan([*impedance_metrics(empty, PlannedPull(5.0, 6.0, 0.5, (10.0, 0.0))).values()]).all(), "it fell"


@pytest.mark.parametrize(("stiffness", "damping", "mass", "phase"), [(1, 0, 0, -0.5), (0, 1, 0, 0.0), (0, 0, 1, 0.5)])
def test_phase_tells_spring_damper_and_mass_apart(stiffness: float, damping: float, mass: float, phase: float) -> None:
    value = impedance(*pulled(0.5, stiffness=stiffness, damping=damping, mass=mass), 0.5, DT)
    assert np.angle(value) == pytest.approx(phase * np.pi, abs=1e-3)


def test_what_does_not_move_has_no_impedance_that_can_be_measured() -> None:
    force, _ = pulled(0.5)
    assert np.isnan(impedance(force, np.zeros_like(force), 0.5, DT))


def test_stiffness_damping_and_mass_follow_from_several_frequencies() -> None:
    frequencies = np.array([0.2, 0.5, 1.0, 2.0])
    values = np.array([impedance(*pulled(one), one, DT) for one in frequencies])
    found = apparent(frequencies, values)
    assert tuple(found.values()) == pytest.approx((STIFFNESS, DAMPING, MASS), rel=1e-3)
    assert [np.isnan(one) for one in apparent(frequencies[:1], values[:1]).values()] == [True, False, True]
