"""Third-party networks: ONNX on onnxruntime, TorchScript on torch, one thread each."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from iowbc.arrays import Array
from iowbc.deploy.controller import open_session
from iowbc.errors import StageFailed

TORCHSCRIPT = (".pt", ".pth", ".jit", ".ts")
"""Suffixes of TorchScript files; pickled weights are not supported."""


def network(path: Path) -> Callable[..., Array]:
    """Load a network as a function from its inputs to its first output, float32 arrays. Raises StageFailed."""
    try:
        if path.suffix == ".onnx":
            session = open_session(path)
            names = [one.name for one in session.get_inputs()]
            return lambda *inputs: np.asarray(session.run(None, dict(zip(names, inputs, strict=True)))[0])
        if path.suffix in TORCHSCRIPT:
            return _torchscript(path)
    except Exception as error:
        raise StageFailed(f"{path}: cannot be read as a network: {error}") from error
    raise StageFailed(f"{path}: is no network; give a file that ends in {', '.join(('.onnx', *TORCHSCRIPT))}")


def metadata(path: Path) -> Mapping[str, Any]:
    """Metadata of an ONNX file, with values decoded from JSON. Raises StageFailed."""
    try:
        said = open_session(path).get_modelmeta().custom_metadata_map
        return {name: json.loads(value) for name, value in said.items()}
    except Exception as error:
        raise StageFailed(f"{path}: its metadata cannot be read: {error}") from error


def _torchscript(path: Path) -> Callable[..., Array]:
    import torch

    torch.set_num_threads(1)  # the result must not depend on the machine's cores
    load: Any = torch.jit.load
    module = load(str(path), map_location="cpu").eval()

    def run(*inputs: Array) -> Array:
        with torch.inference_mode():
            return np.asarray(module(*(torch.from_numpy(np.ascontiguousarray(one)) for one in inputs)).numpy())

    return run
