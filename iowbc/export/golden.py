"""Golden vectors: inputs and outputs of the control step over a short rollout, and the checks made with them."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iowbc.deploy.controller import Values
from iowbc.deploy.timing import INPUT

OUTPUT = "output/"
"""Prefix of the names of outputs in `golden.npz`, beside `INPUT`."""


def stacked(steps: Sequence[Mapping[str, NDArray[np.float32]]]) -> Values:
    """Steps of one robot, each of leading axis 1, as one batch with the steps along the leading axis."""
    return {name: np.concatenate([step[name] for step in steps]) for name in steps[0]}


def played(settle: Callable[[Values], Values], step: Callable[[Values], Values], inputs: Values) -> Values:
    """Outputs of the control step over a rollout of one robot, steps along the leading axis; settle and step: map
    inputs to outputs by name; `inputs`: of every step. Without the state, which is fed back."""
    state: Values = {}
    found = []
    for row in range(len(inputs["command"])):
        given = {name: value[row : row + 1] for name, value in inputs.items()}
        outputs = step(given | (state or settle(given)))
        state = {"state": outputs.pop("state_next")}
        found.append(outputs)
    return stacked(found)


def write_golden(inputs: Values, outputs: Values, path: Path) -> None:
    """Write the vectors; row t of each array is control step t."""
    arrays = {INPUT + name: value for name, value in inputs.items()}
    arrays |= {OUTPUT + name: value for name, value in outputs.items()}
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]


def largest_difference(expected: Values, actual: Values) -> dict[str, float]:
    """Largest absolute difference of each output; infinite where a value is not finite."""
    return {
        name: float(np.nan_to_num(np.abs(value - actual[name]), nan=np.inf).max()) for name, value in expected.items()
    }
