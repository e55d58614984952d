"""How long a control step takes: arm kinematics, reference generator, history and policy of one robot on one thread."""

import time
from dataclasses import fields
from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.control.sensors import Measured
from iowbc.deploy.contract import readable
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import GOLDEN, exported_folder

INPUT = "input/"
"""Prefix of the names of the graph's inputs among the golden vectors."""


def step_seconds(folder: Path | str, steps: int) -> Array:
    """Time of each control step along the golden rollout, which is gone through again and again, and the processor's
    time in it, which other programs do not lengthen, (steps, 2) [s].

    folder: as of `Controller.load`. Raises ContractBroken where it is not what its contract says.
    """
    controller = Controller.load(folder)
    path = exported_folder(folder) / GOLDEN
    with readable(path), np.load(path, allow_pickle=False) as file:
        given = {name.removeprefix(INPUT): file[name] for name in file.files if name.startswith(INPUT)}
    names = [field.name for field in fields(Measured) if field.name in given]
    rows = len(given["command"])
    taken = np.empty((steps, 2))
    for step in range(steps):
        row = slice(step % rows, step % rows + 1)
        measured = Measured(**{name: given[name][row].astype(np.float64) for name in names})
        command = given["command"][row].astype(np.float64)
        if row.start == 0:
            controller.reset()
        used, start = time.thread_time(), time.perf_counter()
        controller.step(measured, command)
        end = time.perf_counter()
        taken[step] = end - start, time.thread_time() - used
    return taken
