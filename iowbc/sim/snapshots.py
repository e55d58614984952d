"""Snapshots of a simulation, one row per environment, independent of the distribution over processes.

A simulation keeps arrays by world (the environments of one scene) and the values of delay lines by period. In a
snapshot worlds are named after their scene (`scene/...`), and delay lines have a row per environment (`ring/...`,
after their first implementation).
"""

from collections.abc import Mapping, Sequence

from iowbc.arrays import Array

DELAY_LINES = ("sensing/robot/values", "sensing/object/values", "partner/line/values")
"""Values of delay lines, (length, n, width)."""


def by_environment(arrays: Mapping[str, Array], scenes: Sequence[str]) -> dict[str, Array]:
    """Arrays of a simulation, each with one row per environment; `scenes`: names of its worlds, in order."""
    rows: dict[str, Array] = {}
    for name, values in arrays.items():
        if name in DELAY_LINES:
            rows[f"ring/{name}"] = values.swapaxes(0, 1)
        elif name.startswith("world"):
            world, _, rest = name.partition("/")
            rows[f"scene/{scenes[int(world.removeprefix('world'))]}/{rest}"] = values
        else:
            rows[f"simulation/{name}"] = values
    return rows


def by_world(rows: Mapping[str, Array], scenes: Sequence[str]) -> dict[str, Array]:
    """Inverse of `by_environment`; other entries are ignored."""
    arrays: dict[str, Array] = {}
    for name, values in rows.items():
        kind, _, rest = name.partition("/")
        if kind == "ring":
            arrays[rest] = values.swapaxes(0, 1)
        elif kind == "scene":
            scene, _, entry = rest.partition("/")
            arrays[f"world{scenes.index(scene)}/{entry}"] = values
        elif kind == "simulation":
            arrays[rest] = values
    return arrays
