"""Indices as slices."""

import numpy as np
import pytest

from iowbc.arrays import as_slice


@pytest.mark.parametrize("indices", [[4], [3, 4, 5], [2, 9], [1, 4, 7]])
def test_indices_at_equal_distances_become_a_slice_of_the_same_places(indices):
    found = as_slice(np.array(indices))
    assert isinstance(found, slice)
    assert np.arange(12)[found].tolist() == indices


@pytest.mark.parametrize("indices", [[], [5, 2], [1, 2, 4], [3, 3]])
def test_other_indices_stay(indices):
    given = np.array(indices, np.int64)
    assert as_slice(given) is given
