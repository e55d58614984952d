"""One atomic file with everything that a resumed training needs, bound to the stage's key."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file
from torch import nn

Arrays = dict[str, NDArray[Any]]


def save_checkpoint(path: Path, key: str, arrays: Mapping[str, NDArray[Any]], state: Mapping[str, Any]) -> None:
    """Replace the checkpoint at `path`; a crash at any moment leaves the old one or the new one."""
    fresh = path.with_suffix(".fresh")
    contiguous = {name: np.ascontiguousarray(value) for name, value in arrays.items()}
    save_file(contiguous, fresh, metadata={"key": key, "state": json.dumps(state)})
    with fresh.open("rb") as file:
        os.fsync(file.fileno())
    os.replace(fresh, path)


def load_checkpoint(path: Path, key: str) -> tuple[Arrays, dict[str, Any]] | None:
    """Arrays and state of a checkpoint; None where there is none, it is damaged, or it belongs to another key."""
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            if metadata.get("key") != key:
                return None
            return {name: file.get_tensor(name) for name in file.keys()}, json.loads(metadata["state"])  # noqa: SIM118
    except (FileNotFoundError, SafetensorError):
        return None


def prefixed(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    """The arrays with `prefix/` before their names."""
    return {f"{prefix}/{name}": value for name, value in arrays.items()}


def under(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    """The arrays whose names begin with `prefix/`, without it."""
    return {name[len(prefix) + 1 :]: value for name, value in arrays.items() if name.startswith(prefix + "/")}


def module_arrays(module: nn.Module) -> Arrays:
    """Parameters and buffers of a network."""
    return {name: value.detach().cpu().numpy().copy() for name, value in module.state_dict().items()}


def restore_module(module: nn.Module, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Inverse of `module_arrays`."""
    module.load_state_dict({name: torch.from_numpy(np.array(value)) for name, value in arrays.items()})


def optimizer_arrays(optimizer: torch.optim.Optimizer) -> Arrays:
    """The moments of an optimiser, by parameter number; its settings come from the recipe."""
    moments = optimizer.state_dict()["state"]
    return {f"{i}.{name}": value.cpu().numpy().copy() for i, entry in moments.items() for name, value in entry.items()}


def restore_optimizer(optimizer: torch.optim.Optimizer, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Inverse of `optimizer_arrays`."""
    moments: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in arrays.items():
        number, field = name.split(".", 1)
        moments.setdefault(int(number), {})[field] = torch.from_numpy(np.array(value))
    optimizer.load_state_dict({"state": moments, "param_groups": optimizer.state_dict()["param_groups"]})


def random_arrays() -> Arrays:
    """The states of torch's and NumPy's global generators, which stable-baselines3 draws from."""
    numpy_state = np.random.get_state(legacy=False)  # noqa: NPY002 - SB3 draws from the global generator
    assert isinstance(numpy_state, dict)
    gauss = [numpy_state["has_gauss"], numpy_state["gauss"]]
    return {
        "torch": torch.get_rng_state().numpy(),
        "numpy": numpy_state["state"]["key"],
        "numpy_position": np.array([numpy_state["state"]["pos"]]),
        "numpy_gauss": np.array(gauss, np.float64),
    }


def restore_random(arrays: Mapping[str, NDArray[Any]]) -> None:
    """Inverse of `random_arrays`."""
    torch.set_rng_state(torch.from_numpy(np.array(arrays["torch"])))
    has_gauss, gauss = arrays["numpy_gauss"]
    state = {"key": arrays["numpy"], "pos": int(arrays["numpy_position"][0])}
    np.random.set_state(  # noqa: NPY002 - SB3 draws from the global generator
        {"bit_generator": "MT19937", "state": state, "has_gauss": int(has_gauss), "gauss": float(gauss)}
    )
