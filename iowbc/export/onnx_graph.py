"""Export of a torch module to a clean ONNX file."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import onnx
import torch

from iowbc.deploy.controller import Values
from iowbc.export.graph import Program


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
