"""Solvers that crash, fail or hang on chosen samples; workers import this module."""

import os
import signal
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from iowbc.errors import Rejected
from iowbc.reference.labels.sample import Sample


class Double:
    """Labels sample i with i; each third has none."""

    def __init__(self, task: "DoubleTask") -> None:
        self.task = task

    def draw(self, indices: Any) -> list[Sample]:
        return [Sample(np.full(14, float(index)), np.zeros(4), np.zeros(2)) for index in indices]

    def solve(self, index: int, sample: Sample) -> dict[str, Any]:
        assert sample.arm[0] == index
        if index in self.task.crashes:
            os.kill(os.getpid(), signal.SIGSEGV)
        if index in self.task.mistakes:
            raise KeyError(f"a mistake at {index}")
        time.sleep(self.task.pause)
        if index % 3 == 0:
            raise Rejected("a third")
        return {"support": np.array([float(index)])}


@dataclass(frozen=True)
class DoubleTask:
    """Makes a double in a worker."""

    crashes: tuple[int, ...] = ()
    mistakes: tuple[int, ...] = ()
    pause: float = 0.0
    start: bool = True

    def prepare(self) -> Double:
        if not self.start:
            os.kill(os.getpid(), signal.SIGSEGV)
        return Double(self)
