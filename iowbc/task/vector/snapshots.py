"""The state of many environments as one set of arrays, whichever processes they live in.

A simulation keeps arrays by world (the environments of one scene) and delay lines as rings of values. Here every array
has a row an environment, worlds go by the name of their scene, and rings begin with their newest value.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = dict[str, NDArray[Any]]

RINGS = ("targets/values", "sensing/robot/values", "sensing/object/values", "partner/line/values")
"""Names of delay lines, (length, n, width); beside each stands the index of its newest value."""


def by_scene(snapshot: Mapping[str, NDArray[Any]], scenes: Sequence[str]) -> Arrays:
    """A simulation's snapshot with a row an environment in every array; `scenes`: names of its worlds, in order."""
    arrays: Arrays = {}
    for name, values in snapshot.items():
        if name in RINGS:
            newest = int(snapshot[_newest(name)][0])
            arrays[f"ring/{name}"] = np.roll(values, -newest, axis=0).swapaxes(0, 1)
        elif name.startswith("world"):
            world, _, rest = name.partition("/")
            arrays[f"scene/{scenes[int(world.removeprefix('world'))]}/{rest}"] = values
        elif name not in map(_newest, RINGS):
            arrays[f"simulation/{name}"] = values
    return arrays


def by_world(arrays: Mapping[str, NDArray[Any]], scenes: Sequence[str]) -> Arrays:
    """Inverse of `by_scene`; other entries are passed over."""
    snapshot: Arrays = {}
    for name, values in arrays.items():
        kind, _, rest = name.partition("/")
        if kind == "ring":
            snapshot[rest] = values.swapaxes(0, 1)
            snapshot[_newest(rest)] = np.zeros(1, np.int64)
        elif kind == "scene":
            scene, _, entry = rest.partition("/")
            snapshot[f"world{scenes.index(scene)}/{entry}"] = values
        elif kind == "simulation":
            snapshot[rest] = values
    return snapshot


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


def _newest(ring: str) -> str:
    return ring.removesuffix("values") + "newest"
