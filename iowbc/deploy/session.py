"""The graph on this machine: onnxruntime on one thread, without its telemetry."""

from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray

onnxruntime.disable_telemetry_events()  # where a process had loaded the library before `iowbc` said so

Values = dict[str, NDArray[np.float32]]


def open_session(path: Path) -> onnxruntime.InferenceSession:
    """A session on one thread: the graph is small, and a control loop shares its processor."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.enable_mem_reuse = False  # its planner takes seconds for the iterations of `settle` and saves 10 MB
    return onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])


def run(session: onnxruntime.InferenceSession, inputs: Values) -> Values:
    """Outputs by name; of the inputs those that the graph has."""
    names = [port.name for port in session.get_outputs()]
    found: list[Any] = session.run(names, {port.name: inputs[port.name] for port in session.get_inputs()})
    return dict(zip(names, found, strict=True))
