"""Arrays of many environments, independent of their processes: memory that parent and workers share, and snapshots.

The memory is anonymous, so that nothing is left behind when a process dies.
"""

import mmap
import os
from collections.abc import Mapping, Sequence

import numpy as np

from iowbc.arrays import Array

ALIGNMENT = 64
"""Arrays start on a cache line, so that workers never write into one another's lines."""

Fields = Mapping[str, tuple[tuple[int, ...], str]]
"""Shape of one environment's part and dtype, by name."""


class Buffers(dict[str, Array]):
    """Arrays that an environment batch reads and writes in each step, by name; rows are environments."""

    def rows(self, first: int, last: int) -> "Buffers":
        return Buffers({name: array[first:last] for name, array in self.items()})


def private_buffers(fields: Fields, rows: int) -> Buffers:
    """Buffers in this process alone."""
    return Buffers({name: np.zeros((rows, *shape), dtype) for name, (shape, dtype) in fields.items()})


def create_shared(fields: Fields, rows: int) -> tuple[int, Buffers]:
    """Shared buffers and the file descriptor that a worker inherits. The memory is freed with its last holder."""
    descriptor = os.memfd_create("iowbc-buffers", os.MFD_CLOEXEC)
    os.ftruncate(descriptor, _place(fields, rows)[1])
    return descriptor, attach_shared(descriptor, fields, rows)


def attach_shared(descriptor: int, fields: Fields, rows: int) -> Buffers:
    """The buffers behind a file descriptor made by `create_shared` with the same fields and rows."""
    offsets, size = _place(fields, rows)
    memory = mmap.mmap(descriptor, size)
    buffers = Buffers()
    for name, (shape, dtype) in fields.items():
        buffers[name] = np.ndarray((rows, *shape), dtype, buffer=memory, offset=offsets[name])
    return buffers


def _place(fields: Fields, rows: int) -> tuple[dict[str, int], int]:
    """Offset of each array and the total size [bytes]."""
    offsets, end = {}, 0
    for name, (shape, dtype) in fields.items():
        offsets[name] = end
        size = rows * int(np.prod(shape, dtype=int)) * np.dtype(dtype).itemsize
        end += -(-size // ALIGNMENT) * ALIGNMENT
    return offsets, max(end, 1)


def join(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """The state of consecutive groups of environments as that of all."""
    names = list(dict.fromkeys(name for part in parts for name in part))
    return {name: np.concatenate([part[name] for part in parts if name in part]) for name in names}


def split(arrays: Mapping[str, Array], scenes: Sequence[Sequence[str]]) -> list[dict[str, Array]]:
    """Inverse of `join` for groups of environments with these scenes, in order."""
    parts: list[dict[str, Array]] = [{} for _ in scenes]
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
