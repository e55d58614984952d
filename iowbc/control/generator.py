"""The frozen reference generator φ_RG: (θ_I_ref, σ_base) → θ_S_ref (paper section III-B)."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from safetensors.numpy import load_file, save_file

from iowbc.arrays import Array, Constants, namespace
from iowbc.robot.description import Robot

WEIGHTS, ARCHITECTURE = "rg.safetensors", "rg.json"
FORMAT = 1
NUMBERS = ("input_mean", "input_std", "output_mean", "output_std", "lower", "upper")
"""Arrays of a network beside its layers."""


@dataclass(frozen=True)
class ReferenceNetwork(Constants):
    """A multilayer perceptron with standardised inputs and outputs, its output kept to the joint limits."""

    inputs: tuple[str, ...]
    """Names: the arm joints, `pelvis_height` or `com_height`, `torso_pitch`; see `input_names`."""
    outputs: tuple[str, ...]
    layers: tuple[tuple[Array, Array], ...]
    """Weight (out, in) and bias (out,) of each layer, float32."""
    input_mean: Array
    input_std: Array
    output_mean: Array
    output_std: Array
    lower: Array
    upper: Array
    """Joint limits of the outputs [rad]."""

    def __call__(self, arm_reference: Array, base_command: Array) -> Array:
        """Support reference (n, 15) [rad] for arms (n, 14) [rad] and base commands (n, 2): height [m], pitch [rad]."""
        xp = namespace(arm_reference)
        x = xp.concatenate([arm_reference, base_command], 1)
        x = x.astype(np.float32) if xp is np else x
        if x.shape[1] != len(self.inputs):
            raise ValueError(
                f"the reference generator takes {len(self.inputs)} inputs ({', '.join(self.inputs)}), got {x.shape[1]}"
            )
        x = (x - self.input_mean) / self.input_std
        for weight, bias in self.layers[:-1]:
            x = _rowwise(x, weight) + bias
            x = np.maximum(x, np.expm1(np.minimum(x, 0.0))) if xp is np else xp.nn.functional.elu(x)
        weight, bias = self.layers[-1]
        output: Array = (_rowwise(x, weight) + bias) * self.output_std + self.output_mean
        return output.clip(self.lower, self.upper)

    def save(self, folder: Path) -> None:
        tensors = {f"layer.{i}.weight": w for i, (w, _) in enumerate(self.layers)}
        tensors |= {f"layer.{i}.bias": b for i, (_, b) in enumerate(self.layers)}
        tensors |= {name: getattr(self, name) for name in NUMBERS}
        save_file({k: np.ascontiguousarray(v, dtype=np.float32) for k, v in tensors.items()}, folder / WEIGHTS)
        architecture = {
            "format": FORMAT,
            "inputs": self.inputs,
            "outputs": self.outputs,
            "hidden": [len(bias) for _, bias in self.layers[:-1]],
            "activation": "elu",
            "output": "clip(network * output_std + output_mean, lower, upper) [rad]",
        }
        (folder / ARCHITECTURE).write_text(json.dumps(architecture, indent=2) + "\n", encoding="utf-8")

    @classmethod
    def of(cls, robot: Robot, height: str, **numbers: Any) -> Self:
        """A network for a robot with its joint limits; `height`: `pelvis` or `com`; `numbers`: layers, means, stds."""
        outputs = tuple(robot.joints[index] for index in robot.support)
        lower, upper = (limit[robot.support].astype(np.float32) for limit in (robot.lower, robot.upper))
        return cls(inputs=input_names(robot, height), outputs=outputs, lower=lower, upper=upper, **numbers)

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Reads the artifact of rg-fit. Raises FileNotFoundError, or ValueError where its parts do not fit together."""
        source = folder / ARCHITECTURE
        if not source.is_file() or not (folder / WEIGHTS).is_file():
            raise FileNotFoundError(
                f"{folder}: no {ARCHITECTURE} with {WEIGHTS}; run `iowbc run RECIPE --until rg-fit`"
            )
        architecture = json.loads(source.read_text(encoding="utf-8"))
        if architecture.get("format") != FORMAT or architecture.get("activation") != "elu":
            raise ValueError(
                f"{source}: format {architecture.get('format')!r}, activation {architecture.get('activation')!r}; "
                f"this version reads format {FORMAT} with elu; make it anew with `--force rg-fit`"
            )
        tensors = load_file(folder / WEIGHTS)
        inputs, outputs = tuple(architecture["inputs"]), tuple(architecture["outputs"])
        sizes = [len(inputs), *architecture["hidden"], len(outputs)]
        layers = tuple((tensors[f"layer.{i}.weight"], tensors[f"layer.{i}.bias"]) for i in range(len(sizes) - 1))
        if any(w.shape != (sizes[i + 1], sizes[i]) or b.shape != (sizes[i + 1],) for i, (w, b) in enumerate(layers)):
            raise ValueError(f"{folder / WEIGHTS}: shapes do not fit {source}; make it anew with `--force rg-fit`")
        if not all(np.isfinite(values).all() for values in tensors.values()):
            raise ValueError(f"{folder / WEIGHTS}: values that are not finite; make it anew with `--force rg-fit`")
        return cls(inputs=inputs, outputs=outputs, layers=layers, **{name: tensors[name] for name in NUMBERS})


def input_names(robot: Robot, height: str) -> tuple[str, ...]:
    """Inputs of a reference generator: arm joints, `pelvis` or `com` height, torso pitch."""
    return (*(robot.joints[index] for index in robot.interaction), f"{height}_height", "torso_pitch")


def _rowwise(x: Array, weight: Array) -> Array:
    """x Wᵀ, (n, in) to (n, out), one product per row: rounding in a product of whole matrices depends on the number of
    rows, and a robot's reference would depend on how many are computed with it."""
    return (x[:, None] @ weight.T)[:, 0]
