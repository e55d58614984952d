"""The paper's errors on signals whose errors are known."""

from dataclasses import replace

import numpy as np
import pytest

from iowbc.evaluation.trials.metrics import Trace, error_norm, moving_average, trial_metrics, wrapped

DT = 0.02
GAIT_STEPS = 40


def trace(steps: int = 400) -> Trace:
    """A robot that stands as commanded, heading along x, with nothing in its hands."""
    zeros = np.zeros(steps)
    return Trace(
        dt=DT,
        system_velocity=np.zeros((steps, 3)),
        commanded_velocity=np.zeros((steps, 3)),
        heading=zeros,
        heading_reference=zeros,
        torso_pitch=zeros,
        torso_pitch_command=zeros,
        pelvis_height=np.full(steps, 0.75),
        height_command=np.full(steps, 0.75),
        saturation=zeros,
        slipped=zeros,
        partner_force=np.zeros((steps, 3)),
        grip_force=np.zeros((steps, 6)),
        power=np.full(steps, 100.0),
        base_position=np.zeros((steps, 3)),
    )


def test_a_perfect_trial_has_no_error() -> None:
    metrics = trial_metrics(trace(), GAIT_STEPS)
    assert [metrics[name] for name in ("E_alpha", "E_h", "E_v", "E_psi", "E_v_raw")] == [0.0] * 5


def test_constant_offsets_come_back_as_errors() -> None:
    exact = trace()
    off = replace(
        exact,
        torso_pitch=exact.torso_pitch - 0.1,
        pelvis_height=exact.pelvis_height + 0.02,
        system_velocity=exact.system_velocity + np.array([0.03, -0.04, 5.0]),
        heading=exact.heading + 0.2,
    )
    metrics = trial_metrics(off, GAIT_STEPS)
    assert metrics["E_alpha"] == pytest.approx(0.1)
    assert metrics["E_h"] == pytest.approx(0.02)
    assert metrics["E_v"] == pytest.approx(0.05), "planar: the vertical 5 m/s does not count"
    assert metrics["E_psi"] == pytest.approx(0.2)


def test_sway_within_a_gait_period_counts_raw_but_not_averaged() -> None:
    exact = trace()
    sway = exact.system_velocity.copy()
    sway[:, 1] = 0.2 * np.sin(2 * np.pi * np.arange(len(sway)) / GAIT_STEPS)
    metrics = trial_metrics(replace(exact, system_velocity=sway), GAIT_STEPS)
    assert metrics["E_v_raw"] == pytest.approx(0.2 * 2 / np.pi, rel=0.01)
    assert metrics["E_v"] < 0.1 * metrics["E_v_raw"]


def test_a_lasting_velocity_error_survives_the_averaging() -> None:
    exact = trace()
    metrics = trial_metrics(
        replace(exact, commanded_velocity=exact.commanded_velocity + np.array([0.4, 0.0, 0.0])), GAIT_STEPS
    )
    assert metrics["E_v"] == pytest.approx(0.4)


def test_heading_error_takes_the_short_way_round() -> None:
    exact = trace()
    metrics = trial_metrics(
        replace(exact, heading=exact.heading + 3.1, heading_reference=exact.heading - 3.1), GAIT_STEPS
    )
    assert metrics["E_psi"] == pytest.approx(2 * np.pi - 6.2)
    assert wrapped(np.array([np.pi, -np.pi, 3 * np.pi])) == pytest.approx([-np.pi] * 3)


def test_energy_is_power_times_time_and_distance_the_path_walked() -> None:
    exact = trace()
    path = exact.base_position.copy()
    path[:, 0] = 0.5 * DT * np.arange(len(path))
    metrics = trial_metrics(replace(exact, base_position=path), GAIT_STEPS)
    assert metrics["energy"] == pytest.approx(100.0 * 400 * DT)
    assert metrics["distance"] == pytest.approx(0.5 * DT * 399)


def test_moving_average_is_centred_and_shortened_at_the_ends() -> None:
    ramp = np.arange(10.0)
    averaged = moving_average(ramp, 3)
    assert averaged[1:-1] == pytest.approx(ramp[1:-1])
    assert (averaged[0], averaged[-1]) == pytest.approx((0.5, 8.5))


def test_a_window_longer_than_the_trial_gives_its_mean() -> None:
    assert moving_average(np.array([1.0, 3.0]), 50) == pytest.approx([2.0, 2.0])


def test_a_trial_without_a_step_is_refused() -> None:
    with pytest.raises(ValueError, match="without a single step"):
        trial_metrics(trace(0), GAIT_STEPS)


def test_error_norm_is_euclidean() -> None:
    assert error_norm(np.array([[0.0, 0.0, 3.0, 4.0]])) == pytest.approx([5.0])
