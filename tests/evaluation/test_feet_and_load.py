"""Slip, swing clearance, and who carries the object, on signals that are known."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_trials import DT, trace

from iowbc.evaluation.trials.feet import foot_metrics, runs
from iowbc.evaluation.trials.interaction import load_metrics


def test_only_loaded_feet_slip() -> None:
    signals = trace(100)
    slide, load = signals.foot_slide.copy(), signals.foot_load.copy()
    slide[:50, 0] = 0.1  # left foot, loaded in the first half
    load[50:, 0] = 0.0
    slide[50:, 0] = 2.0
    metrics = foot_metrics(replace(signals, foot_slide=slide, foot_load=load), 50.0, walked=2.0)
    assert metrics["foot_slip"] == pytest.approx(0.1 * 50 * DT)
    assert metrics["foot_slip_per_metre"] == pytest.approx(0.05)


def test_the_largest_slip_is_that_of_one_stance() -> None:
    signals = trace(90)
    load, slide = signals.foot_load.copy(), signals.foot_slide.copy()
    load[30:60, 0] = 0.0
    slide[:30, 0], slide[60:, 0] = 0.1, 0.3
    metrics = foot_metrics(replace(signals, foot_slide=slide, foot_load=load), 50.0, walked=0.0)
    assert metrics["foot_slip_peak"] == pytest.approx(0.3 * 30 * DT)
    assert np.isnan(metrics["foot_slip_per_metre"]), "nobody walked"


def test_feet_that_tremble_do_not_drift_and_feet_that_creep_do() -> None:
    signals = trace(100)
    load, position = signals.foot_load.copy(), signals.foot_position.copy()
    position[:, 0] = 0.004 * (-1.0) ** np.arange(100)  # the left foot trembles
    position[:, 3] = np.linspace(0.0, 0.05, 100)  # the right one creeps, and is lifted and set down ahead meanwhile
    load[40:50, 1] = 0.0
    position[50:, 3] += 0.4
    metrics = foot_metrics(replace(signals, foot_position=position, foot_load=load), 50.0, walked=2.0)
    assert metrics["foot_drift"] == pytest.approx(0.05 * (39 + 49) / 99 + 0.008)
    assert metrics["foot_drift_per_metre"] == pytest.approx(0.5 * metrics["foot_drift"])


def test_swing_clearance_is_the_mean_of_the_highest_points_of_each_foot() -> None:
    signals = trace(100)
    contact, position = signals.foot_contact.copy(), signals.foot_position.copy()
    for begin, height in ((10, 0.06), (50, 0.10)):
        contact[begin : begin + 20, 0] = 0
        position[begin : begin + 20, 2] = height * np.sin(np.pi * np.linspace(0, 1, 20))
    contact[80:82, 0] = contact[84:88, 1] = 0  # chatter
    metrics = foot_metrics(replace(signals, foot_contact=contact, foot_position=position), 50.0, walked=1.0)
    assert metrics["swings"] == 2
    assert metrics["swing_clearance_left"] == pytest.approx(0.08, rel=0.01)
    assert metrics["swing_clearance_right"] == 0.0


def test_runs_are_where_the_mask_is_true() -> None:
    assert runs(np.array([True, False, True, True])) == [slice(0, 1), slice(2, 4)]
    assert runs(np.zeros(3, bool)) == []


def test_what_the_partner_bears_is_not_asked_of_the_hands() -> None:
    signals = trace(200)
    grip, partner = signals.grip_force.copy(), signals.partner_force.copy()
    grip[:, [2, 5]], partner[:, 2] = -20.0, 40.0  # 40 N by the hands, 40 N by the partner, of 80 N
    held = replace(signals, grip_force=grip, partner_force=partner, external_force=partner)
    metrics = load_metrics(held, 80.0)
    assert metrics["hand_weight_share"] == pytest.approx(0.5)
    assert metrics["partner_weight_share"] == pytest.approx(0.5)
    assert metrics["weight_in_hands"] == pytest.approx(1.0)


def test_weight_on_the_thighs_is_not_in_the_hands() -> None:
    signals = trace(200)
    grip = signals.grip_force.copy()
    grip[:, [2, 5]] = -10.0
    assert load_metrics(replace(signals, grip_force=grip), 40.0)["weight_in_hands"] == pytest.approx(0.5)


def test_impulses_on_the_object_load_the_hands_beyond_its_weight() -> None:
    signals = trace(200)
    grip, external = signals.grip_force.copy(), signals.external_force.copy()
    grip[:, [2, 5]], external[60:70, 2] = -20.0, -70.0
    grip[60:70, [2, 5]] -= 35.0
    held = replace(signals, grip_force=grip, external_force=external)
    assert load_metrics(held, 40.0)["weight_in_hands"] == pytest.approx(1.0)


def test_where_a_weight_rests_that_a_touch_exceeds_is_not_asked() -> None:
    assert np.isnan(load_metrics(trace(200), 0.5, judged=False)["weight_in_hands"])


def test_without_an_object_in_the_hands_there_is_no_share() -> None:
    assert np.isnan(list(load_metrics(trace(200), 0.0).values())).all()
