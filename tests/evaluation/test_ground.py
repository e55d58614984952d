"""Impacts, centre of pressure and friction, on signals that are known."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_trials import DT, trace

from iowbc.evaluation.trials.feet import ground_metrics


def test_the_touchdown_speed_of_a_sine_is_its_slope_where_it_ends() -> None:
    signals = trace(200)
    contact, sink = signals.foot_contact.copy(), signals.foot_sink.copy()
    for foot, begin, height in ((0, 20, 0.05), (1, 80, 0.10)):
        time = DT * np.arange(1, 21)  # a swing of 0.4 s
        contact[begin : begin + 20, foot] = 0
        sink[begin : begin + 20, foot] = -height * np.pi / 0.4 * np.cos(np.pi * time / 0.4)
    metrics = ground_metrics(replace(signals, foot_contact=contact, foot_sink=sink), 50.0, 1.0)
    assert metrics["touchdown_speed"] == pytest.approx(0.075 * np.pi / 0.4)
    assert metrics["touchdown_speed_peak"] == pytest.approx(0.10 * np.pi / 0.4)


def test_a_foot_that_chatters_or_never_comes_down_has_no_touchdown() -> None:
    signals = trace(100)
    contact = signals.foot_contact.copy()
    contact[20:22, 0] = 0
    contact[60:, 1] = 0
    metrics = ground_metrics(replace(signals, foot_contact=contact, foot_sink=np.ones((100, 2))), 50.0, 1.0)
    assert np.isnan([metrics["touchdown_speed"], metrics["touchdown_speed_peak"]]).all()


def test_the_peak_force_is_the_largest_of_any_physics_step() -> None:
    signals = trace(100)
    peak = signals.foot_peak.copy()
    peak[30, 1] = 900.0
    assert ground_metrics(replace(signals, foot_peak=peak), 50.0, 1.0)["foot_force_peak"] == 900.0


def test_margins_count_loaded_feet_by_what_they_bear() -> None:
    signals = trace(100)
    load, margin, shear = signals.foot_load.copy(), signals.foot_margin.copy(), signals.foot_shear.copy()
    load[:] = (300.0, 100.0)
    margin[:] = (0.03, 0.01)
    shear[:] = (30.0, 50.0)
    margin[50:, 1], load[50:, 1] = 0.0, 0.0  # in the air
    metrics = ground_metrics(replace(signals, foot_load=load, foot_margin=margin, foot_shear=shear), 50.0, 0.5)
    borne = 300.0 * 100 + 100.0 * 50
    assert metrics["pressure_margin"] == pytest.approx((0.03 * 300.0 * 100 + 0.01 * 100.0 * 50) / borne)
    assert metrics["pressure_margin_low"] == pytest.approx(0.01)
    assert metrics["friction_use"] == pytest.approx((0.2 * 300.0 * 100 + 1.0 * 100.0 * 50) / borne)
    assert metrics["friction_use_high"] == pytest.approx(1.0), "the light foot is about to slip"
