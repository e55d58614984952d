"""Golden vectors: inputs and outputs of the graph over a short rollout, and the checks made with them."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import onnxruntime
from numpy.typing import NDArray

from iowbc.deploy.session import Values
from iowbc.deploy.timing import INPUT

OUTPUT = "output/"
"""Prefix of the names of outputs in `golden.npz`, beside `INPUT`."""


def stacked(steps: Sequence[Mapping[str, NDArray[np.float32]]]) -> Values:
    """Steps of one robot, each of leading axis 1, as one batch with the steps along the leading axis."""
    return {name: np.concatenate([step[name] for step in steps]) for name in steps[0]}


def write_golden(inputs: Values, outputs: Values, path: Path) -> None:
    """Write the vectors; row t of each array is control step t."""
    arrays = {INPUT + name: value for name, value in inputs.items()}
    arrays |= {OUTPUT + name: value for name, value in outputs.items()}
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]


def read_golden(path: Path) -> tuple[Values, Values]:
    """Inputs and outputs by name."""
    with np.load(path, allow_pickle=False) as file:
        arrays = {name: file[name] for name in file.files}
    inputs = {name.removeprefix(INPUT): value for name, value in arrays.items() if name.startswith(INPUT)}
    outputs = {name.removeprefix(OUTPUT): value for name, value in arrays.items() if name.startswith(OUTPUT)}
    return inputs, outputs


def largest_difference(expected: Values, actual: Values) -> dict[str, float]:
    """Largest absolute difference of each output; infinite where a value is not finite."""
    return {
        name: float(np.nan_to_num(np.abs(value - actual[name]), nan=np.inf).max()) for name, value in expected.items()
    }


def inference_seconds(session: onnxruntime.InferenceSession, inputs: Values, repeats: int) -> NDArray[np.float64]:
    """Time of each of `repeats` inferences of one robot, shape (repeats,) [s]."""
    rows = len(next(iter(inputs.values())))
    times = np.empty(repeats)
    for index in range(repeats):
        step = {name: value[index % rows : index % rows + 1] for name, value in inputs.items()}
        start = time.perf_counter()
        session.run(None, step)
        times[index] = time.perf_counter() - start
    return times
