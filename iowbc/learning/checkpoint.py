"""One atomic file with everything that a resumed training needs, bound to the stage's key."""

import os
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file
from torch import nn

from iowbc.errors import Damaged
from iowbc.files import replacing, synchronise

Arrays = dict[str, NDArray[Any]]


def save_checkpoint(path: Path, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Replace the checkpoint at `path` and keep the one before beside it; a crash at any moment leaves one of them."""
    contiguous = {name: np.ascontiguousarray(value) for name, value in arrays.items()}
    metadata = {"key": key, "crc32": _checksum(contiguous)}
    with replacing(path) as fresh:
        save_file(contiguous, fresh, metadata=metadata)
        synchronise(fresh)
        if path.is_file():
            os.replace(path, previous_checkpoint(path))


def previous_checkpoint(path: Path) -> Path:
    """Where the checkpoint before the one at `path` is kept."""
    return path.with_suffix(".previous")


def load_checkpoint(path: Path, key: str, say: Callable[[str], None]) -> Arrays | None:
    """Arrays of the newest whole checkpoint of this key, or None; `say` is told of damaged ones.

    They are put aside as `<name>.damaged`, lest the next save keeps one of them as the previous checkpoint.
    """
    damaged, found = [], None
    for candidate in (path, previous_checkpoint(path)):
        try:
            found = _read(candidate, key)
        except Damaged:
            damaged.append(candidate.name)
            os.replace(candidate, candidate.with_name(f"{candidate.name}.damaged"))
        if found is not None:
            break
    if damaged:
        names = " and ".join(damaged)
        verb = "is" if len(damaged) == 1 else "are"
        say(f"checkpoint {names} {verb} damaged: {'starts anew' if found is None else 'goes on from the previous one'}")
    return found


def _read(path: Path, key: str) -> Arrays | None:
    """One file's arrays; None where there is none or it belongs to another key. Raises Damaged."""
    if not path.is_file():
        return None
    try:
        with safe_open(path, framework="numpy") as file:
            metadata = file.metadata() or {}
            if metadata["key"] != key:
                return None
            arrays: Arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (OSError, SafetensorError, KeyError, ValueError) as reason:
        raise Damaged(f"{path} is not readable: {reason}") from reason
    if metadata.get("crc32") not in (None, _checksum(arrays)):
        raise Damaged(f"{path} differs from its checksum")
    return arrays


def _checksum(arrays: Mapping[str, NDArray[Any]]) -> str:
    """CRC-32 of the arrays' bytes, in order of their names."""
    value = 0
    for name in sorted(arrays):
        value = zlib.crc32(np.ascontiguousarray(arrays[name]).tobytes(), value)
    return f"{value:08x}"


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
