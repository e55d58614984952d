"""Control step and initial state as torch modules, traced from the equations of `iowbc.control`."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from iowbc.control.command import COMMAND
from iowbc.control.observation import OBJECT, PROPRIOCEPTION, ObservationLayout
from iowbc.control.references import ReferenceLayer
from iowbc.control.sensors import Measured, quantities
from iowbc.control.step import STATE, ControlStep
from iowbc.deploy.contract import PortEntry
from iowbc.learning.networks import StudentNetwork
from iowbc.recipe.task.task import Task
from iowbc.robot.description import Robot


def port_entry(name: str, shape: tuple[int, ...], unit: str, frame: str, meaning: str) -> PortEntry:
    return PortEntry(name=name, shape=shape, unit=unit, frame=frame, meaning=meaning)


GRASP = port_entry("grasp", (2, 3), "m", "heading", "base grasp of both wrists")


class Program(nn.Module):
    """A graph with named inputs and outputs, whose leading axis is the number of robots."""

    inputs: tuple[PortEntry, ...]
    outputs: tuple[PortEntry, ...]

    def _named(self, values: Sequence[Tensor]) -> dict[str, Any]:
        """Inputs by name: tensors where annotations say arrays."""
        return dict(zip((port.name for port in self.inputs), values, strict=True))


class SettleProgram(Program):
    """`settle.onnx`: the initial state of a robot."""

    def __init__(self, equations: ControlStep, command: PortEntry, heading: PortEntry, state: PortEntry) -> None:
        super().__init__()
        self.equations = equations
        self.inputs, self.outputs = (command, heading, GRASP), (state,)
        self.eval()

    def forward(self, *values: Tensor) -> tuple[Any, ...]:
        return (self.equations.packed(self.equations.settle(**self._named(values))),)


class StepProgram(Program):
    """`step.onnx`: one control period."""

    def __init__(
        self, equations: ControlStep, student: StudentNetwork, inputs: tuple[PortEntry, ...], joints: int, support: int
    ) -> None:
        super().__init__()
        self.equations, self.student, self.inputs = equations, student, inputs
        self.outputs = (
            port_entry("target", (joints,), "rad", "joint", "targets of the PD loop, all joints"),
            port_entry("action", (support,), "action", "joint", "residual action, clipped"),
            port_entry("support_reference", (support,), "rad", "joint", "θ_S_ref with the gait prior"),
            inputs[-1].model_copy(update={"name": "state_next", "meaning": "the next step's `state`"}),
        )
        self.eval().requires_grad_(False)

    def forward(self, *values: Tensor) -> tuple[Any, ...]:
        given = self._named(values)
        others = {name: given.pop(name) for name in ("command", "grasp", "load", "state")}
        state = self.equations.unpacked(others.pop("state"))
        step = self.equations.step(Measured(**given), **others, state=state)
        return step.target, step.action, step.support_reference, self.equations.packed(step.state)


class ControllerGraph:
    """Both programs of a student with its references."""

    def __init__(
        self,
        student: StudentNetwork,
        robot: Robot,
        task: Task,
        layout: ObservationLayout,
        history: int,
        references: ReferenceLayer,
    ) -> None:
        equations = ControlStep(robot, task, references, layout, history, student)
        self.robot, self.student, self.layout, self.history, self.equations = robot, student, layout, history, equations
        self.state = tuple(port_entry(name, equations.shapes[name], *about) for name, about in STATE.items())
        """Parts of the packed state, in order."""
        seen = {**quantities(of_object=False)}
        if OBJECT[0].name in layout.names:
            seen |= quantities(of_object=True)
        measured = {
            name: port_entry(name, (len(what.kind(robot)),), what.unit, what.frame, what.meaning)
            for name, what in seen.items()
        }
        meaning = "the wanted command C: rate-limited and clamped inside"
        command = port_entry("command", (len(COMMAND),), PROPRIOCEPTION[0].unit, "heading", meaning)
        state = port_entry("state", (sum(equations.sizes.values()),), "SI", "-", "what the loop remembers")
        load = port_entry("load", (1,), "kg", "-", "mass expected between the hands")
        traced = equations.converted(lambda values: torch.from_numpy(np.ascontiguousarray(values, np.float32)))
        self.settle = SettleProgram(traced, command, measured["heading"], state)
        inputs = (command, *measured.values(), GRASP, load, state)
        self.step = StepProgram(traced, student, inputs, len(robot.joints), len(robot.support))
