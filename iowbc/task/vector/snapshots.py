"""The state of many environments as one set of arrays, whichever processes they live in."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]


def join(parts: Sequence[Mapping[str, NDArray[Any]]]) -> Arrays:
    """The state of consecutive groups of environments as that of all."""
    names = list(dict.fromkeys(name for part in parts for name in part))
    return {name: np.concatenate([part[name] for part in parts if name in part]) for name in names}


def split(arrays: Mapping[str, NDArray[Any]], scenes: Sequence[Sequence[str]]) -> list[Arrays]:
    """Inverse of `join` for groups of environments with these scenes, in order."""
    parts: list[Arrays] = [{} for _ in scenes]
    for name, values in arrays.items():
        start = 0
        for part, group in zip(parts, scenes, strict=True):
            count = group.count(name.split("/")[1]) if name.startswith("scene/") else len(group)
            if count:
                part[name] = values[start : start + count]
            start += count
        if start != len(values):
            raise ValueError(f"state of other environments: {name} has {len(values)} rows, expected {start}")
    return parts
