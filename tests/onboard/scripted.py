"""An operator that follows a script, and a simulated robot in a process of its own."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.onboard.machine import OperatorRequest, State
from iowbc.onboard.messages import Record

STARTS = ((0.2, State.DAMPING), (1.5, State.STAND), (4.6, State.RUN))
"""When a script asks for which state [s]; Stand takes 3 s."""
SETTLED = 8.0
"""When a robot stands without its support [s]."""


class Script:
    """Asks for the states in turn, and for a velocity from `SETTLED` on."""

    def __init__(
        self, standing: Array, velocity: tuple[float, float, float], seconds: float, end: Callable[[], None]
    ) -> None:
        """`end` is called once after some time [s], if the robot still runs by then."""
        self._standing, self._velocity, self._seconds, self._end = standing, np.array(velocity), seconds, end
        self._begin: float | None = None
        self._asked = 0
        self.ended = False

    def wanted(self, now: float, state: Record | None) -> OperatorRequest:
        self._begin = now if self._begin is None else self._begin
        passed = now - self._begin
        request = None
        if self._asked < len(STARTS) and passed >= STARTS[self._asked][0]:
            request = STARTS[self._asked][1]
            self._asked += 1
        if passed >= self._seconds and not self.ended:
            self.ended = True
            self._end()
        command = self._standing.copy()
        command[:3] = self._velocity * (passed >= SETTLED)
        return OperatorRequest(command, now, request)


@contextmanager
def simulated(folder: Path | str, *options: str, domain: int) -> Iterator["subprocess.Popen[str]"]:
    """A simulated robot on the loopback that has begun to send; its output is that of the process."""
    command = [sys.executable, "-m", "iowbc", "robot-sim", str(folder), "--domain", str(domain), *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert "Ctrl+C ends" in line, line + process.stdout.read()
        yield process
    finally:
        process.terminate()
        process.wait(60)
        if process.stdout is not None:
            process.stdout.close()
