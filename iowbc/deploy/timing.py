"""Duration of a control step: arm kinematics, reference generator, history and policy of one robot on one thread."""

import itertools
import time
from dataclasses import fields
from pathlib import Path

import numpy as np

from iowbc.arrays import Array
from iowbc.control.sensors import Measured
from iowbc.deploy.contract import readable
from iowbc.deploy.controller import Controller
from iowbc.deploy.exported_folder import GOLDEN, exported_folder
from iowbc.deploy.skill import Skill

INPUT = "input/"
"""Prefix of the names of the graph's inputs among the golden vectors."""


def step_seconds(folder: Path | str, steps: int, skill: Path | None = None) -> Array:
    """Wall time and CPU time of control steps along the repeated golden rollout, (steps, 2) [s], without the first step
    of each, which also settles the references. folder: as in `Controller.load`; `skill`: folder of a skill whose
    commands replace the rollout's. Raises ContractBroken if one does not match its contract."""
    controller = Controller.load(folder)
    commanding = None if skill is None else Skill.load(skill, controller)
    path = exported_folder(folder) / GOLDEN
    with readable(path), np.load(path, allow_pickle=False) as file:
        given = {name.removeprefix(INPUT): file[name] for name in file.files if name.startswith(INPUT)}
    names = [field.name for field in fields(Measured) if field.name in given]
    rows, taken, step = len(given["command"]), np.empty((steps, 2)), 0
    for row in itertools.cycle(range(rows)):
        if step == steps:
            break
        if row == 0:
            controller.reset()
            if commanding is not None:
                commanding.reset()
        measured = Measured(**{name: given[name][row : row + 1].astype(np.float64) for name in names})
        command = given["command"][row : row + 1].astype(np.float64)
        used, start = time.thread_time(), time.perf_counter()
        controller.step(measured, command if commanding is None else commanding.step(measured))
        end = time.perf_counter()
        taken[step] = end - start, time.thread_time() - used
        step += row > 0
    return taken
