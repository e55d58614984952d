"""Control step and initial state as torch modules, from the equations of `iowbc.control`, and as clean ONNX files."""

import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import torch
from torch import Tensor, nn

from iowbc.control.command import COMMAND
from iowbc.control.observation import OBJECT, PROPRIOCEPTION, ObservationLayout
from iowbc.control.references import ReferenceLayer
from iowbc.control.sensors import Measured, quantities
from iowbc.control.step import STATE, ControlStep
from iowbc.deploy.contract import PortEntry
from iowbc.deploy.controller import Values
from iowbc.learning.networks import StudentNetwork
from iowbc.recipe.task.task import Task
from iowbc.robot.description import Robot


def port_entry(name: str, shape: tuple[int, ...], unit: str, frame: str, meaning: str) -> PortEntry:
    return PortEntry(name=name, shape=shape, unit=unit, frame=frame, meaning=meaning)


GRASP = port_entry("grasp", (2, 3), "m", "heading", "base grasp of both wrists")


class Program(nn.Module):
    """A function of named inputs as a graph, whose leading axis is the number of robots."""

    def __init__(
        self,
        function: Callable[..., tuple[Any, ...]],
        inputs: tuple[PortEntry, ...],
        outputs: tuple[PortEntry, ...],
        network: nn.Module | None = None,
    ) -> None:
        """`function`: from the inputs by name, tensors where annotations say arrays, to the outputs in order;
        `network`: in the function, which contains its weights."""
        super().__init__()
        self._function, self.inputs, self.outputs, self.network = function, inputs, outputs, network
        self.eval().requires_grad_(False)

    def forward(self, *values: Tensor) -> tuple[Any, ...]:
        return self._function(**dict(zip((port.name for port in self.inputs), values, strict=True)))


class ControllerGraph:
    """Both programs of a student with its references."""

    def __init__(
        self,
        student: StudentNetwork,
        robot: Robot,
        task: Task,
        layout: ObservationLayout,
        references: ReferenceLayer,
    ) -> None:
        equations = ControlStep(robot, task, references, layout, student.history, student)
        self.robot, self.student, self.layout, self.equations = robot, student, layout, equations
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

        def settle(**given: Any) -> tuple[Any, ...]:
            return (traced.packed(traced.settle(**given)),)

        def step(command: Any, grasp: Any, load: Any, state: Any, **given: Any) -> tuple[Any, ...]:
            before = traced.unpacked(state)
            made = traced.step(Measured(**given), command=command, grasp=grasp, load=load, state=before)
            return made.target, made.action, made.support_reference, traced.packed(made.state)

        outputs = (
            port_entry("target", (len(robot.joints),), "rad", "joint", "targets of the PD loop, all joints"),
            port_entry("action", (len(robot.support),), "action", "joint", "residual action, clipped"),
            port_entry("support_reference", (len(robot.support),), "rad", "joint", "θ_S_ref with the gait prior"),
            state.model_copy(update={"name": "state_next", "meaning": "the next step's `state`"}),
        )
        self.settle = Program(settle, (command, measured["heading"], GRASP), (state,))
        """`settle.onnx`: the initial state of a robot."""
        self.step = Program(step, (command, *measured.values(), GRASP, load, state), outputs, student)
        """`step.onnx`: one control period."""


def write_onnx(program: Program, path: Path, opset: int, about: Mapping[str, str]) -> None:
    """Write the module with named inputs and outputs and any number of robots as leading axis; about: texts for the
    file's metadata. Source locations are removed. The exporter is the tracing one: the other takes two minutes for the
    iterations of `settle`."""
    ports, names = program.inputs, [port.name for port in program.inputs]
    outputs = [port.name for port in program.outputs]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # deprecation and constant folding
        torch.onnx.export(
            program,
            tuple(torch.zeros(2, *port.shape) for port in ports),  # an example of one row would fix the axis
            path,
            input_names=names,
            output_names=outputs,
            opset_version=opset,
            dynamo=False,
            dynamic_axes={name: {0: "robots"} for name in (*names, *outputs)},
        )
    model = onnx.load(path)
    for part in (model, model.graph, *model.graph.node, *model.graph.input, *model.graph.output):
        part.ClearField("doc_string")
        part.ClearField("metadata_props")
    del model.graph.value_info[:]
    _shorten_names(model.graph, {*names, *outputs})
    onnx.helper.set_model_props(model, dict(about))
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def _shorten_names(graph: onnx.GraphProto, kept: set[str]) -> None:
    """Replace names of inner values, module paths that are a third of the file, by numbers."""
    numbered: dict[str, str] = {}

    def short(name: str) -> str:
        return name if name in kept or not name else numbered.setdefault(name, f"v{len(numbered)}")

    for tensor in graph.initializer:
        tensor.name = short(tensor.name)
    for index, node in enumerate(graph.node):
        node.name = f"n{index}"
        node.input[:], node.output[:] = map(short, node.input), map(short, node.output)


def run_torch(program: Program, inputs: Values) -> Values:
    """Outputs of the torch module by name."""
    with torch.inference_mode():
        outputs = program(*(torch.from_numpy(inputs[port.name]) for port in program.inputs))
    return {port.name: value.numpy() for port, value in zip(program.outputs, outputs, strict=True)}
