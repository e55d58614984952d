"""Shared memory between parent and workers."""

import os

import numpy as np
import pytest

from iowbc.rollouts.blocks import shares_in_blocks
from iowbc.task.vector.shared import attach_shared, create_shared, private_buffers

FIELDS = {"action": ((3,), "float32"), "done": ((), "bool"), "sum": ((2, 2), "float64")}


def test_both_ends_see_the_same_values() -> None:
    descriptor, ours = create_shared(FIELDS, 5)
    theirs = attach_shared(descriptor, FIELDS, 5)
    os.close(descriptor)
    ours["action"][:] = np.arange(15).reshape(5, 3)
    theirs["sum"][2] = 7.0
    assert np.array_equal(theirs["action"], ours["action"])
    assert ours["sum"][2].tolist() == [[7.0, 7.0], [7.0, 7.0]]
    assert not ours["done"].any()


def test_fields_do_not_overlap_and_rows_are_views() -> None:
    buffers = private_buffers(FIELDS, 5)
    rows = buffers.rows(1, 3)
    rows["action"][:] = 1.0
    assert buffers["action"].sum(axis=1).tolist() == [0.0, 3.0, 3.0, 0.0, 0.0]
    descriptor, shared = create_shared(FIELDS, 5)
    os.close(descriptor)
    for name in FIELDS:
        shared[name][:] = 1
        others = [other for other in FIELDS if other != name]
        assert not any(shared[other].any() for other in others)
        shared[name][:] = 0


@pytest.mark.parametrize(("count", "parts"), [(7, 3), (8, 2), (3, 3), (100, 7)])
def test_environments_are_shared_out_evenly_and_completely(count: int, parts: int) -> None:
    groups = shares_in_blocks(count, parts, 1)
    assert [group[0] for group in groups[1:]] == [group[1] for group in groups[:-1]]
    assert (groups[0][0], groups[-1][1]) == (0, count)
    sizes = [last - first for first, last in groups]
    assert max(sizes) - min(sizes) <= 1
