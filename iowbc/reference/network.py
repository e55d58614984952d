"""The reference generator φ_RG as it is used: a frozen network in NumPy, read from the artifact of `rg-fit`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import load_file, save_file

from iowbc.reference.sample import COMMANDS

Array = NDArray[Any]

WEIGHTS, DESCRIPTION = "rg.safetensors", "rg.json"
FORMAT = 1
BASE_INPUTS = {"height": "pelvis_height", "pitch": "torso_pitch", "roll": "torso_roll", "yaw": "torso_yaw"}
"""Name of the network's input for each column of a sample's command."""
PAYLOAD_INPUTS = ("left_payload", "right_payload")
"""Inputs for the mass at each wrist [kg], where the recipe samples it."""
VECTORS = ("input_mean", "input_std", "output_mean", "output_std", "lower", "upper")


def base_inputs(*, roll: bool, yaw: bool, payload: bool) -> tuple[str, ...]:
    """Names of the inputs beside the arm joints: height and pitch, then what a recipe samples of roll, yaw, payloads."""
    sampled = {"height": True, "pitch": True, "roll": roll, "yaw": yaw}
    names = [BASE_INPUTS[name] for name in COMMANDS if sampled[name]]
    return (*names, *(PAYLOAD_INPUTS if payload else ()))


@dataclass(frozen=True)
class ReferenceNetwork:
    """A multilayer perceptron on standardised inputs and outputs: support posture from arm posture and base command."""

    inputs: tuple[str, ...]
    """Names of the inputs: the arm joints, `pelvis_height`, `torso_pitch`, then what else the recipe sampled."""
    outputs: tuple[str, ...]
    """Names of the support joints."""
    layers: tuple[tuple[Array, Array], ...]
    """Weight (out, in) and bias (out,) of each layer; ELU between them."""
    input_mean: Array
    input_std: Array
    output_mean: Array
    output_std: Array
    lower: Array
    upper: Array
    """Joint limits of the outputs [rad]."""
    activation: str = "elu"

    def __call__(self, arm_reference: Array, base_command: Array) -> Array:
        """θ_S_ref (n, 15) [rad] from θ_I_ref (n, 14) [rad] and the other inputs (n, inputs - 14), as named in `inputs`."""
        value = (np.concatenate([arm_reference, base_command], axis=1) - self.input_mean) / self.input_std
        last = len(self.layers) - 1
        for index, (weight, bias) in enumerate(self.layers):
            value = value @ weight.T + bias
            if index < last:
                value = np.where(value > 0.0, value, np.expm1(np.minimum(value, 0.0)))
        kept: Array = np.clip(value * self.output_std + self.output_mean, self.lower, self.upper)
        return kept

    def save(self, folder: Path, about: dict[str, Any]) -> None:
        """Writes `rg.safetensors` and `rg.json`; `about` is added to the JSON."""
        tensors = {name: np.ascontiguousarray(getattr(self, name), np.float32) for name in VECTORS}
        for index, (weight, bias) in enumerate(self.layers):
            tensors[f"layers.{index}.weight"] = np.ascontiguousarray(weight, np.float32)
            tensors[f"layers.{index}.bias"] = np.ascontiguousarray(bias, np.float32)
        save_file(tensors, folder / WEIGHTS)
        description = {
            "format": FORMAT,
            "inputs": list(self.inputs),
            "outputs": list(self.outputs),
            "widths": [len(bias) for _, bias in self.layers],
            "activation": self.activation,
            **about,
        }
        (folder / DESCRIPTION).write_text(json.dumps(description, indent=1) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Reads the artifact of `rg-fit`. Raises FileNotFoundError, or ValueError naming what does not fit."""
        path = folder / DESCRIPTION
        if not path.is_file() or not (folder / WEIGHTS).is_file():
            raise FileNotFoundError(f"{folder}: no {DESCRIPTION} with {WEIGHTS}; run `iowbc run RECIPE --until rg-fit`")
        about = json.loads(path.read_text(encoding="utf-8"))
        if about.get("format") != FORMAT or about.get("activation") != "elu":
            raise ValueError(
                f"{path}: format {about.get('format')!r} with activation {about.get('activation')!r}; this version "
                f"reads format {FORMAT} with 'elu': run `rg-fit` again"
            )
        tensors = {name: value.astype(np.float64) for name, value in load_file(folder / WEIGHTS).items()}
        inputs, outputs = tuple(about["inputs"]), tuple(about["outputs"])
        count = len(about["widths"])
        names = [*VECTORS, *(f"layers.{index}.{part}" for index in range(count) for part in ("weight", "bias"))]
        wrong = sorted(set(names) ^ set(tensors)) or [n for n in names if not np.isfinite(tensors[n]).all()]
        if wrong:
            raise ValueError(f"{folder / WEIGHTS}: missing, unknown or not finite: {', '.join(wrong)}")
        sizes = [len(inputs), *about["widths"]]
        for index in range(count):
            shape = tensors[f"layers.{index}.weight"].shape
            if shape != (sizes[index + 1], sizes[index]):
                raise ValueError(
                    f"{folder / WEIGHTS}: layer {index} is {shape}, {path.name} says {sizes[index + 1], sizes[index]}"
                )
        return cls(
            inputs=inputs,
            outputs=outputs,
            layers=tuple((tensors[f"layers.{i}.weight"], tensors[f"layers.{i}.bias"]) for i in range(count)),
            activation=about["activation"],
            **{name: tensors[name] for name in VECTORS},
        )
