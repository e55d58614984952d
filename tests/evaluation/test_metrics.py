"""The paper's errors on signals whose errors are known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_trials import DT, GAIT_STEPS, RECIPE, ROBOT, outcome, script, trace

from iowbc.evaluation.trials.errors import ERRORS, error_norm, moving_average
from iowbc.evaluation.trials.metrics import effort_metrics, jerk, second_difference, trial_metrics
from iowbc.robot.rotations import wrapped
from iowbc.task.episodes import CommandScript, Episode
from iowbc.task.record.signals import Trace


def metrics_of(signals: Trace, commands: CommandScript | None = None, strength: float = 1.0) -> dict[str, float]:
    commands = commands or script()
    episode = Episode("free", 0, commands.duration, script=commands)
    return trial_metrics(RECIPE, ROBOT, episode, outcome(signals, strength=strength))


def test_a_perfect_trial_has_no_error() -> None:
    metrics = metrics_of(trace())
    assert [metrics[name] for name in (*ERRORS, "E_v_raw")] == [0.0] * 5


def test_constant_offsets_come_back_as_errors() -> None:
    exact = trace()
    off = replace(
        exact,
        torso_pitch=exact.torso_pitch - 0.1,
        pelvis_height=exact.pelvis_height + 0.02,
        system_velocity=exact.system_velocity + np.array([0.03, -0.04, 5.0]),
        heading=exact.heading + 0.2,
    )
    metrics = metrics_of(off)
    assert metrics["E_alpha"] == pytest.approx(0.1)
    assert metrics["E_h"] == pytest.approx(0.02)
    assert metrics["E_v"] == pytest.approx(0.05), "planar: the vertical 5 m/s does not count"
    assert metrics["E_psi"] == pytest.approx(0.2)


def test_sway_within_a_gait_period_counts_raw_but_not_averaged() -> None:
    exact = trace()
    sway = exact.system_velocity.copy()
    sway[:, 1] = 0.2 * np.sin(2 * np.pi * np.arange(len(sway)) / GAIT_STEPS)
    metrics = metrics_of(replace(exact, system_velocity=sway))
    assert metrics["E_v_raw"] == pytest.approx(0.2 * 2 / np.pi, rel=0.01)
    assert metrics["E_v"] < 0.1 * metrics["E_v_raw"]


def test_errors_are_told_against_the_command_as_given_and_as_clamped() -> None:
    exact = trace()
    clamped = replace(exact, commanded_velocity=exact.commanded_velocity + np.array([0.3, 0.0, 0.0]))
    metrics = metrics_of(clamped, script(velocity=(0.4, 0.0, 0.0)))
    assert metrics["E_v"] == pytest.approx(0.4)
    assert metrics["E_v_clamped"] == pytest.approx(0.3)


def test_the_heading_of_a_given_turn_is_integrated_from_the_start() -> None:
    turning = script(velocity=(0.0, 0.0, 0.5))
    heading = 1.0 + 0.5 * DT * np.arange(1, 401)
    start = trace()
    turned = replace(start, heading=heading, heading_reference=start.heading_reference + 1.0)
    metrics = metrics_of(turned, turning)
    assert metrics["E_psi"] == pytest.approx(0.0, abs=1e-9)
    assert metrics["E_psi_clamped"] == pytest.approx(np.mean(np.abs(wrapped(heading - 1.0))))


def test_errors_over_the_moving_part_leave_standing_out() -> None:
    walk = script(4.0).segments + script(4.0, (0.4, 0.0, 0.0)).segments
    metrics = metrics_of(trace(), CommandScript(walk))
    assert metrics["E_v"] == pytest.approx(0.2, abs=0.002)
    assert metrics["E_v_moving"] == pytest.approx(0.4, abs=0.002)
    assert np.isnan(metrics_of(trace())["E_v_moving"]), "no steps were asked for"


def test_what_standing_still_scores_is_computed_from_the_script_alone() -> None:
    turning = script(velocity=(0.3, 0.0, 0.25))
    fallen = replace(trace(10), torso_pitch=np.full(10, 1.0))
    metrics = metrics_of(fallen, turning)
    assert metrics["still_E_v"] == pytest.approx(0.3)
    assert metrics["still_E_psi"] == pytest.approx(1.0, abs=0.01), "half of the 2 rad turned in 8 s"
    assert (metrics["still_E_alpha"], metrics["still_E_h"]) == (0.0, 0.0)


def test_heading_error_takes_the_short_way_round() -> None:
    exact = trace()
    metrics = metrics_of(replace(exact, heading=exact.heading + 3.1, heading_reference=exact.heading - 3.1))
    assert metrics["E_psi"] == pytest.approx(2 * np.pi - 6.2)
    assert wrapped(np.array([np.pi, -np.pi, 3 * np.pi])) == pytest.approx([-np.pi] * 3)


def test_energy_is_power_times_time_and_distance_the_path_walked() -> None:
    exact = trace()
    path = exact.base_position.copy()
    path[:, 0] = 0.5 * DT * np.arange(len(path))
    metrics = metrics_of(replace(exact, base_position=path))
    assert metrics["energy"] == pytest.approx(100.0 * 400 * DT)
    shortened = GAIT_STEPS / 2  # by averages at both ends
    assert metrics["distance"] == pytest.approx(0.5 * DT * (399 - shortened), abs=0.01)


def test_peak_torque_and_saturation_are_told_by_joint() -> None:
    torque = np.zeros((400, 2))
    torque[100] = (3.0, -30.0)
    saturated = np.zeros((400, 2))
    saturated[:40, 1] = 1.0
    metrics = metrics_of(replace(trace(), joint_torque=torque, joint_saturation=saturated))
    assert (metrics["peak_torque/hip"], metrics["peak_torque/knee"]) == (3.0, 30.0)
    assert (metrics["saturated/hip"], metrics["saturated/knee"]) == (0.0, 0.1)


def test_jerk_is_the_third_derivative_of_the_path() -> None:
    time = DT * np.arange(50)
    cubic = np.stack([0.5 * time**3, np.zeros(50), np.zeros(50)], axis=1)
    assert jerk(cubic, DT) == pytest.approx(3.0)
    assert np.isnan(jerk(cubic[:3], DT))


def test_the_second_difference_of_the_action_is_that_of_a_parabola_and_none_of_a_line() -> None:
    steps = np.arange(50.0)
    action = np.stack([0.5 * 0.01 * steps**2, 0.3 * steps], axis=1)
    assert second_difference(action) == pytest.approx(0.01 / 2**0.5), "one of two joints, root mean square"
    metrics = metrics_of(replace(trace(50), action=action))
    assert metrics["action_second_difference"] == pytest.approx(0.01 / 2**0.5)
    assert np.isnan(second_difference(action[:2]))


def test_torque_is_measured_against_the_limit_of_each_joint_and_the_worst_one_counts() -> None:
    torque = np.zeros((400, 2))
    torque[:, 0] = 20.0 * (-1.0) ** np.arange(400)  # of 80 N·m
    torque[::2, 1] = 30.0  # half of the time, of 100 N·m
    metrics = metrics_of(replace(trace(), joint_torque=torque))
    assert metrics["torque_rms/hip"] == pytest.approx(0.25)
    assert metrics["torque_rms/knee"] == pytest.approx(0.3 / 2**0.5)
    assert metrics["torque_rms"] == metrics["torque_rms/hip"]
    weak = metrics_of(replace(trace(), joint_torque=torque), strength=0.5)
    assert weak["torque_rms/hip"] == pytest.approx(0.5), "20 of 40 N·m"


def test_joints_of_a_linkage_share_its_limit() -> None:
    torque = np.tile([15.0, -10.0], (400, 1))
    linked = SimpleNamespace(**{**vars(ROBOT), "linkages": np.array([[0, 1]])})
    metrics = effort_metrics(replace(trace(), joint_torque=torque), linked, np.array([50.0, 50.0]))
    assert metrics["torque_rms/hip"] == metrics["torque_rms/knee"] == pytest.approx(0.5)
    assert metrics["peak_torque/knee"] == pytest.approx(10.0)


def test_swaying_is_not_walking() -> None:
    sway = np.zeros((400, 3))
    sway[:, 1] = 0.05 * np.sin(2 * np.pi * np.arange(400) / GAIT_STEPS)
    sway[:, 0] = np.linspace(0.0, 2.0, 400)
    assert metrics_of(replace(trace(), base_position=sway))["distance"] == pytest.approx(2.0, rel=0.1)


def test_the_raw_velocity_error_is_told_of_the_moving_part_too() -> None:
    walk = script(4.0).segments + script(4.0, (0.4, 0.0, 0.0)).segments
    metrics = metrics_of(trace(), CommandScript(walk))
    assert metrics["E_v_raw_moving"] == pytest.approx(0.4, abs=0.002)
    assert np.isnan(metrics_of(trace())["E_v_raw_moving"])


def test_moving_average_is_centred_and_shortened_at_the_ends() -> None:
    ramp = np.arange(10.0)
    averaged = moving_average(ramp, 3)
    assert averaged[1:-1] == pytest.approx(ramp[1:-1])
    assert (averaged[0], averaged[-1]) == pytest.approx((0.5, 8.5))


def test_a_window_longer_than_the_trial_gives_its_mean() -> None:
    assert moving_average(np.array([1.0, 3.0]), 50) == pytest.approx([2.0, 2.0])


def test_a_trial_without_a_step_is_refused() -> None:
    with pytest.raises(ValueError, match="without a single step"):
        metrics_of(trace(0))


def test_error_norm_is_euclidean() -> None:
    assert error_norm(np.array([[0.0, 0.0, 3.0, 4.0]])) == pytest.approx([5.0])
