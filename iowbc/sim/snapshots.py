"""Snapshots of a simulation, one row per environment, independent of the distribution over processes.

A simulation keeps arrays by world (the environments of one scene) and delay lines as rings of values. In a snapshot
worlds are named after their scene (`scene/...`), and rings begin with their newest value (`ring/...`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from iowbc.arrays import Array

RINGS = ("sensing/robot/values", "sensing/object/values", "partner/line/values")
"""Names of delay lines, (length, n, width); beside each stands the index of its newest value."""


def by_environment(arrays: Mapping[str, Array], scenes: Sequence[str]) -> dict[str, Array]:
    """Arrays of a simulation, each with one row per environment; `scenes`: names of its worlds, in order."""
    rows: dict[str, Array] = {}
    for name, values in arrays.items():
        if name in RINGS:
            newest = int(arrays[_newest(name)][0])
            rows[f"ring/{name}"] = np.roll(values, -newest, axis=0).swapaxes(0, 1)
        elif name.startswith("world"):
            world, _, rest = name.partition("/")
            rows[f"scene/{scenes[int(world.removeprefix('world'))]}/{rest}"] = values
        elif name not in map(_newest, RINGS):
            rows[f"simulation/{name}"] = values
    return rows


def by_world(rows: Mapping[str, Array], scenes: Sequence[str]) -> dict[str, Array]:
    """Inverse of `by_environment`; other entries are ignored."""
    arrays: dict[str, Array] = {}
    for name, values in rows.items():
        kind, _, rest = name.partition("/")
        if kind == "ring":
            arrays[rest] = values.swapaxes(0, 1)
            arrays[_newest(rest)] = np.zeros(1, np.int64)
        elif kind == "scene":
            scene, _, entry = rest.partition("/")
            arrays[f"world{scenes.index(scene)}/{entry}"] = values
        elif kind == "simulation":
            arrays[rest] = values
    return arrays


def _newest(ring: str) -> str:
    return ring.removesuffix("values") + "newest"
