"""Checkpoints: one atomically written file with the whole training state, bound to the stage's key."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors.numpy import load, save
from torch import nn

from iowbc.files import newest_checked, write_checked

Arrays = dict[str, NDArray[Any]]
Kind = TypeVar("Kind")


def save_checkpoint(path: Path, key: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Replace the checkpoint at `path` and keep the previous one beside it. A crash at any time leaves one intact."""
    content = save({name: np.ascontiguousarray(value) for name, value in arrays.items()})
    write_checked(path, key, content, keep_previous=True)


def load_checkpoint(path: Path, key: str, say: Callable[[str], None]) -> Arrays | None:
    """Arrays of the newest intact checkpoint of this key, or None; damaged ones are moved aside and passed to `say`."""
    content, damaged = newest_checked(path, key)
    if damaged:
        names, verb = " and ".join(damaged), "is" if len(damaged) == 1 else "are"
        then = "starts anew" if content is None else "goes on from the previous one"
        say(f"checkpoint {names} {verb} damaged: {then}")
    return None if content is None else load(content)


def prefixed(prefix: str, arrays: Mapping[str, NDArray[Any]]) -> Arrays:
    """The arrays with `prefix/` before their names."""
    return {f"{prefix}/{name}": value for name, value in arrays.items()}


def under(prefix: str, arrays: Mapping[str, Kind], separator: str = "/") -> dict[str, Kind]:
    """The arrays or tensors whose names begin with the prefix and `separator`, with both removed."""
    beginning = prefix + separator
    return {name.removeprefix(beginning): value for name, value in arrays.items() if name.startswith(beginning)}


def module_arrays(module: nn.Module) -> Arrays:
    """Parameters and buffers of a network; inverse of `restore_module`."""
    return {name: value.detach().cpu().numpy().copy() for name, value in module.state_dict().items()}


def restore_module(module: nn.Module, arrays: Mapping[str, NDArray[Any]]) -> None:
    module.load_state_dict({name: torch.from_numpy(np.array(value)) for name, value in arrays.items()})


def optimizer_arrays(optimizer: torch.optim.Optimizer) -> Arrays:
    """The moments of an optimiser, by parameter number, for `restore_optimizer`; its settings come from the recipe."""
    moments = optimizer.state_dict()["state"]
    return {f"{i}.{name}": value.cpu().numpy().copy() for i, entry in moments.items() for name, value in entry.items()}


def restore_optimizer(optimizer: torch.optim.Optimizer, arrays: Mapping[str, NDArray[Any]]) -> None:
    moments: dict[int, dict[str, torch.Tensor]] = {}
    for name, value in arrays.items():
        number, field = name.split(".", 1)
        moments.setdefault(int(number), {})[field] = torch.from_numpy(np.array(value))
    optimizer.load_state_dict({"state": moments, "param_groups": optimizer.state_dict()["param_groups"]})
