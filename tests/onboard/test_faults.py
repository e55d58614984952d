"""Faults between twin and state machine: the state that is reached, and the time to damping."""

from pathlib import Path

import pytest
from faults import FAULTS, play

from iowbc.onboard.machine import State

pytestmark = pytest.mark.integration
QUICK = ("30 % of states lost", "all states lost, or publisher stopped", "joint position NaN")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in FAULTS]
)
def test_a_fault_damps_the_robot_in_time_or_leaves_it_running(blind: Path, name: str) -> None:
    fault = FAULTS[name]
    end = play(blind, fault)
    if fault.damped is None:
        assert (end.state, end.fallen) == (State.RUN, False)
    else:
        assert end.reason.startswith(fault.damped)
        assert end.time <= fault.within
