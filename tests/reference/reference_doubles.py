"""Doubles for the tests of the reference generator: solvers that crash, fail or hang, and a recipe of both stages.

Labelling workers import this module.
"""

import json
import os
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from iowbc.errors import Rejected
from iowbc.recipe.recipe import Recipe
from iowbc.reference.labels.support_model import Sample

SMALL: dict[str, Any] = {
    "sampling": {"samples": 400, "mirrored_share": 0.1},
    "feasible": {"heights": 9, "pitches": 11, "jump": 0.3},
    "crosscheck": {"samples": 3},
    "fit": {
        "epochs": 60,
        "batch": 64,
        "smoothness": {"lines": 20},
        "gates": {
            "joint_rmse": 0.3,
            "height_p95": 0.1,
            "pitch_p95": 0.3,
            "foot_p95": 0.1,
            "margin_p1": None,
            "jump": None,
        },
    },
}


def small_recipe(**changes: Any) -> Recipe:
    """The small recipe with other values, by dotted path with `__` for the dots."""
    rg = json.loads(json.dumps(SMALL))
    for path, value in changes.items():
        *sections, name = path.split("__")
        place = rg
        for section in sections:
            place = place.setdefault(section, {})
        place[name] = value
    return Recipe.model_validate({"name": "small", "rg": rg})


class Double:
    """Labels sample i with i; each third has none."""

    def __init__(self, task: "DoubleTask") -> None:
        self.task = task

    def draw(self, indices: Any) -> list[Sample]:
        return [Sample(np.full(14, float(index)), np.zeros(2)) for index in indices]

    def solve(self, sample: Sample) -> dict[str, Any]:
        index = int(sample.arm[0])
        if index in self.task.crashes:
            os.kill(os.getpid(), signal.SIGSEGV)
        if index in self.task.killed and self.task.first_time(index):
            os.kill(os.getpid(), signal.SIGKILL)
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
    killed: tuple[int, ...] = ()
    """Samples on which a worker is killed: once each where `marks` names a folder, else every time."""
    marks: str = ""
    pause: float = 0.0
    robot: Path = Path()
    start: bool = True

    def first_time(self, index: int) -> bool:
        if not self.marks:
            return True
        mark = Path(self.marks) / str(index)
        known = mark.exists()
        mark.touch()
        return not known

    def prepare(self) -> Double:
        if not self.start:
            os.kill(os.getpid(), signal.SIGSEGV)
        return Double(self)
