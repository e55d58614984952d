"""From the torch module to a clean ONNX file."""

import logging
import warnings
from collections.abc import Mapping
from pathlib import Path

import onnx
import torch

from iowbc.deploy.session import Values
from iowbc.export.graph import ControllerGraph

LEADING_AXIS = "robots"


def write_onnx(graph: ControllerGraph, path: Path, opset: int, about: Mapping[str, str]) -> None:
    """Write the module with named inputs and outputs and any number of robots as leading axis.

    about: texts kept in the file's metadata. Traces of source files, which the exporter leaves, are removed.
    """
    ports = graph.input_ports()
    example = tuple(torch.zeros(2, *port.shape) for port in ports)  # an example of one row would fix the axis
    with warnings.catch_warnings(), _quiet("torch.onnx"):
        warnings.simplefilter("ignore", FutureWarning)  # torch's own use of a name that it deprecates
        warnings.filterwarnings("ignore", ".*_flat_weights", UserWarning)  # views that nn.GRU keeps of its parameters
        program = torch.onnx.export(
            graph,
            example,
            input_names=[port.name for port in ports],
            output_names=[port.name for port in graph.output_ports()],
            opset_version=opset,
            dynamo=True,
            dynamic_shapes=(tuple({0: torch.export.Dim.DYNAMIC} for _ in ports),),
            verbose=False,
        )
    assert program is not None
    model = program.model_proto
    values = (*model.graph.input, *model.graph.output, *model.graph.value_info)
    for part in (model, model.graph, *model.graph.node, *values):
        part.ClearField("metadata_props")
        part.ClearField("doc_string")
    for value in values:
        for axis in value.type.tensor_type.shape.dim:
            if axis.dim_param:
                axis.dim_param = LEADING_AXIS
    onnx.helper.set_model_props(model, dict(about))
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, path)


def run_torch(graph: ControllerGraph, inputs: Values) -> Values:
    """Outputs of the torch module by name."""
    with torch.inference_mode():
        outputs = graph(*(torch.from_numpy(inputs[port.name]) for port in graph.input_ports()))
    return {port.name: value.numpy() for port, value in zip(graph.output_ports(), outputs, strict=True)}


class _quiet:
    """Keeps a logger below errors within a block: the exporter reports operators of packages that are not installed."""

    def __init__(self, name: str) -> None:
        self.logger = logging.getLogger(name)

    def __enter__(self) -> None:
        self.level = self.logger.level
        self.logger.setLevel(logging.ERROR)

    def __exit__(self, *_: object) -> None:
        self.logger.setLevel(self.level)
