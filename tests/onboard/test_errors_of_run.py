"""Errors of a logged run."""

import numpy as np
import pytest

from iowbc.control.command import COMMAND, YAW_RATE
from iowbc.onboard.errors_of_run import LoggedRun


def test_the_commanded_heading_begins_anew_after_a_pause() -> None:
    half = np.arange(100) * 0.02
    time, turning = np.concatenate([half, half + 60.0]), 0.4
    command = np.zeros((200, len(COMMAND)))
    command[:, YAW_RATE] = turning
    heading = np.concatenate([turning * half, 1.0 + turning * half])
    run = LoggedRun(time, command, np.zeros(200), np.zeros(200), heading, np.zeros((200, 2)))
    assert run.wanted_heading == pytest.approx(heading)
    assert run.deviations()["E_ψ"] == pytest.approx(0.0, abs=1e-12)
